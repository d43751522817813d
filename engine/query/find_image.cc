// SPDX-License-Identifier: Apache-2.0
#include "engine/query/find_image.h"

#include <algorithm>
#include <charconv>
#include <utility>
#include <vector>

#include "engine/query/visibility.h"

namespace veduta {
namespace {

// More images than these are not listed where a text means several.
constexpr size_t kListedMax = 5;
// So many images of one name, or of the same first digits, are looked at. Chosen by hand; more of
// one name have as many contributors, of which most are out of sight.
constexpr size_t kLookedAtMax = 100;
// Behind more slashes than these no name is sought: each costs a look. Chosen by hand.
constexpr int kSlashesMax = 64;

size_t CountFor(const Visibility& visibility) {
  return visibility.SeesAll() ? kListedMax + 1 : kLookedAtMax;
}

// Those of them that may be told.
Result<std::vector<ImageId>> KeepSeen(std::vector<ImageId> images, const Visibility& visibility) {
  std::vector<ImageId> seen;
  for (const ImageId image : images) {
    VEDUTA_ASSIGN_OR_RETURN(const bool sees, visibility.Sees(image));
    if (sees) seen.push_back(image);
  }
  return seen;
}

Result<std::vector<ImageId>> FindNamed(const Snapshot& snapshot, std::string_view text,
                                       const Visibility& visibility) {
  VEDUTA_ASSIGN_OR_RETURN(std::vector<ImageId> images,
                          snapshot.FindImagesByName(text, CountFor(visibility)));
  // Contributors and names may have slashes of their own.
  size_t slash = text.find('/');
  for (int i = 0; i < kSlashesMax && slash != text.npos; ++i, slash = text.find('/', slash + 1)) {
    VEDUTA_ASSIGN_OR_RETURN(
        const std::optional<ImageId> image,
        snapshot.FindImageByName(text.substr(slash + 1), text.substr(0, slash)));
    if (image && std::ranges::find(images, *image) == images.end()) images.push_back(*image);
  }
  return KeepSeen(std::move(images), visibility);
}

// The digits in lower case; empty where it is something else, or too short.
std::string HashDigits(const std::string& text) {
  std::string digits;
  for (const char c : text) {
    const bool is_upper = c >= 'A' && c <= 'F';
    if (!is_upper && !(c >= '0' && c <= '9') && !(c >= 'a' && c <= 'f')) return "";
    digits += is_upper ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return digits.size() < kHashDigitsMin ? "" : digits;
}

// The one that "#" and its number or its whole hash name, if it is there.
Result<std::optional<ImageRecord>> FindExact(const Snapshot& snapshot, const std::string& text,
                                             const std::vector<ImageId>& hashed,
                                             const Visibility& visibility) {
  std::optional<ImageId> image;
  uint32_t number = 0;
  if (text.size() > 1 && text[0] == '#') {
    const char* const last = text.data() + text.size();
    const auto [end, error] = std::from_chars(text.data() + 1, last, number);
    if (error == std::errc() && end == last) image = ImageId(number);
  } else if (text.size() == 2 * sizeof(ContentHash) && hashed.size() == 1) {
    image = hashed.front();
  }
  if (!image) return std::optional<ImageRecord>();
  Result<ImageRecord> record = snapshot.GetImage(*image);
  if (record.status().code() == StatusCode::kNotFound) return std::optional<ImageRecord>();
  VEDUTA_RETURN_IF_ERROR(record.status());
  VEDUTA_ASSIGN_OR_RETURN(const bool sees, visibility.Sees(*record));
  return sees ? std::optional(std::move(*record)) : std::nullopt;
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

Result<ImageRecord> FindImage(const Snapshot& snapshot, const std::string& text,
                              const Sight& sight) {
  const Visibility visibility(snapshot, sight);
  const std::string digits = HashDigits(text);
  std::vector<ImageId> hashed;
  if (!digits.empty()) {
    VEDUTA_ASSIGN_OR_RETURN(hashed, snapshot.FindImagesByPhoto(digits, CountFor(visibility)));
    VEDUTA_ASSIGN_OR_RETURN(hashed, KeepSeen(std::move(hashed), visibility));
  }
  VEDUTA_ASSIGN_OR_RETURN(std::optional<ImageRecord> exact,
                          FindExact(snapshot, text, hashed, visibility));
  if (exact) return std::move(*exact);
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ImageId> named, FindNamed(snapshot, text, visibility));
  if (!named.empty()) return TheOne(snapshot, text, named);
  if (!hashed.empty()) return TheOne(snapshot, text, hashed);
  return Status::NotFound("there is no image '" + text + "' in the database");
}

}  // namespace veduta
