// SPDX-License-Identifier: Apache-2.0
#include "engine/query/find_image.h"

#include <algorithm>
#include <charconv>
#include <vector>

namespace veduta {
namespace {

// More images than these are not listed where a text means several.
constexpr size_t kListedMax = 5;

Result<std::vector<ImageId>> FindNamed(const Snapshot& snapshot, std::string_view text) {
  VEDUTA_ASSIGN_OR_RETURN(std::vector<ImageId> images,
                          snapshot.FindImagesByName(text, kListedMax + 1));
  // Contributors and names may have slashes of their own.
  for (size_t slash = text.find('/'); slash != text.npos; slash = text.find('/', slash + 1)) {
    VEDUTA_ASSIGN_OR_RETURN(
        const std::optional<ImageId> image,
        snapshot.FindImageByName(text.substr(slash + 1), text.substr(0, slash)));
    if (image && std::ranges::find(images, *image) == images.end()) images.push_back(*image);
  }
  return images;
}

Result<std::vector<ImageId>> FindByHash(const Snapshot& snapshot, std::string text) {
  const auto is_digit = [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
  };
  if (text.size() < kHashDigitsMin || !std::ranges::all_of(text, is_digit))
    return std::vector<ImageId>();
  for (char& c : text) {
    if (c >= 'A' && c <= 'F') c = static_cast<char>(c - 'A' + 'a');
  }
  return snapshot.FindImagesByPhoto(text, kListedMax + 1);
}

Result<ImageRecord> TheOne(const Snapshot& snapshot, const std::string& text,
                           const std::vector<ImageId>& images) {
  if (images.size() == 1) return snapshot.GetImage(images.front());
  std::string list;
  for (size_t i = 0; i < std::min(images.size(), kListedMax); ++i) {
    VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, snapshot.GetImage(images[i]));
    list += (list.empty() ? "" : ", ") + std::string("#") + std::to_string(image.id.value) +
            " is '" + image.contributor + "/" + image.name + "'";
  }
  return Status::InvalidArgument("'" + text + "' may mean several photos; say which: " + list +
                                 (images.size() > kListedMax ? ", and more" : ""));
}

}  // namespace

Result<ImageRecord> FindImage(const Snapshot& snapshot, const std::string& text) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ImageId> named, FindNamed(snapshot, text));
  if (!named.empty()) return TheOne(snapshot, text, named);
  uint32_t number = 0;
  if (text.size() > 1 && text[0] == '#') {
    const char* const last = text.data() + text.size();
    const auto [end, error] = std::from_chars(text.data() + 1, last, number);
    if (error == std::errc() && end == last) return snapshot.GetImage(ImageId(number));
  }
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ImageId> hashed, FindByHash(snapshot, text));
  if (!hashed.empty()) return TheOne(snapshot, text, hashed);
  return Status::NotFound("there is no image '" + text + "' in the database");
}

}  // namespace veduta
