// SPDX-License-Identifier: Apache-2.0
#include "engine/model_photos.h"

#include <algorithm>
#include <charconv>
#include <filesystem>

namespace veduta {
namespace {

namespace fs = std::filesystem;

std::string WithoutEscapes(const std::string& name) {
  std::string text;
  for (size_t i = 0; i < name.size(); ++i) {
    uint8_t byte = 0;
    const char* const digits = name.data() + i + 1;
    if (name[i] == '%' && i + 2 < name.size() &&
        std::from_chars(digits, digits + 2, byte, 16).ptr == digits + 2) {
      text += static_cast<char>(byte);
      i += 2;
    } else {
      text += name[i];
    }
  }
  return text;
}

// Whether the name stays below the folder that it is relative to, as far as it says.
bool IsBelow(const fs::path& name) {
  return !name.empty() && name.is_relative() && name.has_filename() &&
         name.native().find('\0') == std::string::npos &&
         std::ranges::none_of(name, [](const fs::path& part) { return part == ".."; });
}

}  // namespace

Result<ModelPhotoFile> FindModelPhoto(const std::string& folder, const std::string& name) {
  std::error_code failure;
  const fs::path root = fs::canonical(folder, failure);
  if (failure) return Status::NotFound(folder + " cannot be opened: " + failure.message());
  for (const std::string& tried : {name, WithoutEscapes(name)}) {
    if (!IsBelow(tried))
      return Status::InvalidArgument("its name leads out of the folder of photos");
    const fs::path path = fs::canonical(root / tried, failure);
    if (failure) continue;
    const auto [end, rest] = std::ranges::mismatch(root, path);
    if (end != root.end())
      return Status::InvalidArgument("a link leads out of the folder of photos");
    if (!fs::is_regular_file(path, failure)) return Status::InvalidArgument("it is not a file");
    return ModelPhotoFile{tried, path.string()};
  }
  return Status::NotFound("there is no such file in the folder of photos");
}

}  // namespace veduta
