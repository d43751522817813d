// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/exif.h"

#include <algorithm>
#include <exception>
#include <exiv2/exiv2.hpp>
#include <mutex>
#include <string_view>

namespace veduta {
namespace {

constexpr size_t kTextSizeMax = 64;    // longer ones are no names
constexpr double kNumberMax = 10'000;  // no lens has so many mm

std::string TextOf(const Exiv2::ExifData& data, const char* key) {
  const auto found = data.findKey(Exiv2::ExifKey(key));
  if (found == data.end() || found->size() > static_cast<long>(2 * kTextSizeMax)) return {};
  const std::string stored = found->toString();
  // What follows a zero is filling.
  std::string_view text(stored.data(), std::min(stored.size(), stored.find('\0')));
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  const bool is_name =
      text.size() <= kTextSizeMax &&
      std::all_of(text.begin(), text.end(), [](char c) { return c >= ' ' && c <= '~'; });
  return is_name ? std::string(text) : std::string();
}

double NumberOf(const Exiv2::ExifData& data, const char* key) {
  const auto found = data.findKey(Exiv2::ExifKey(key));
  if (found == data.end() || found->count() == 0) return 0;
  const auto [above, below] = found->toRational(0);
  if (above <= 0 || below <= 0) return 0;
  const double number = static_cast<double>(above) / below;
  return number <= kNumberMax ? number : 0;
}

}  // namespace

ExifCamera ReadExifCamera(std::span<const uint8_t> exif) {
  static std::mutex mutex;  // exiv2 keeps tables of its own
  const std::lock_guard lock(mutex);
  try {
    Exiv2::LogMsg::setLevel(Exiv2::LogMsg::mute);
    Exiv2::ExifData data;
    Exiv2::ExifParser::decode(data, exif.data(), static_cast<uint32_t>(exif.size()));
    ExifCamera camera;
    camera.make = TextOf(data, "Exif.Image.Make");
    camera.model = TextOf(data, "Exif.Image.Model");
    camera.lens = TextOf(data, "Exif.Photo.LensModel");
    camera.focal_mm = NumberOf(data, "Exif.Photo.FocalLength");
    camera.digital_zoom = NumberOf(data, "Exif.Photo.DigitalZoomRatio");
    return camera;
  } catch (const std::exception&) {  // exiv2 tells of broken blocks that way
    return {};
  }
}

}  // namespace veduta
