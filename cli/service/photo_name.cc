// SPDX-License-Identifier: Apache-2.0
#include "cli/service/photo_name.h"

#include <algorithm>

#include "storage/base/plain_text.h"

namespace veduta {
namespace {

// Chosen by hand: paths that people make are shorter.
constexpr size_t kNameBytesMax = 1024;

}  // namespace

Status CheckName(const std::string& what, const std::string& name) {
  if (name.size() > kNameBytesMax || !IsPlainText(name, false))
    return Status::InvalidArgument(what + " must be UTF-8 without control characters, of at most " +
                                   std::to_string(kNameBytesMax) + " bytes");
  return Status::Ok();
}

Status CheckPhotoName(const std::string& name) {
  VEDUTA_RETURN_IF_ERROR(CheckName("the name of a photo", name));
  for (size_t begin = 0; begin <= name.size();) {
    const size_t end = std::min(name.find('/', begin), name.size());
    const std::string part = name.substr(begin, end - begin);
    if (part.empty() || part == "." || part == "..")
      return Status::InvalidArgument("the name of a photo is a path below a folder, and '" + name +
                                     "' leads out of it");
    begin = end + 1;
  }
  return Status::Ok();
}

}  // namespace veduta
