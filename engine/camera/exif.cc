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

// Degrees, minutes and seconds as one number; nothing where it is none.
std::optional<double> DegreesOf(const Exiv2::ExifData& data, const char* key) {
  const auto found = data.findKey(Exiv2::ExifKey(key));
  if (found == data.end() || found->count() < 1 || found->count() > 3) return std::nullopt;
  double degrees = 0, unit = 1;
  for (long i = 0; i < found->count(); ++i, unit /= 60) {
    const auto [above, below] = found->toRational(i);
    // Some leave minutes or seconds out as 0/0.
    if (i > 0 && above == 0 && below == 0) continue;
    if (above < 0 || below <= 0) return std::nullopt;
    degrees += unit * above / below;
  }
  return degrees;
}

// What read(data) makes of a block; `none` where it is broken.
template <typename Value, typename Read>
Value ReadExif(std::span<const uint8_t> exif, Value none, const Read& read) {
  static std::mutex mutex;  // exiv2 keeps tables of its own
  const std::lock_guard lock(mutex);
  try {
    Exiv2::LogMsg::setLevel(Exiv2::LogMsg::mute);
    Exiv2::ExifData data;
    Exiv2::ExifParser::decode(data, exif.data(), static_cast<uint32_t>(exif.size()));
    return read(data);
  } catch (const std::exception&) {  // exiv2 tells of broken blocks that way
    return none;
  }
}

ExifCamera CameraOf(const Exiv2::ExifData& data) {
  ExifCamera camera;
  camera.make = TextOf(data, "Exif.Image.Make");
  camera.model = TextOf(data, "Exif.Image.Model");
  camera.lens = TextOf(data, "Exif.Photo.LensModel");
  camera.focal_mm = NumberOf(data, "Exif.Photo.FocalLength");
  camera.digital_zoom = NumberOf(data, "Exif.Photo.DigitalZoomRatio");
  return camera;
}

std::optional<GpsFix> GpsOf(const Exiv2::ExifData& data) {
  if (TextOf(data, "Exif.GPSInfo.GPSStatus") == "V") return std::nullopt;
  const auto latitude = DegreesOf(data, "Exif.GPSInfo.GPSLatitude"),
             longitude = DegreesOf(data, "Exif.GPSInfo.GPSLongitude");
  const std::string north = TextOf(data, "Exif.GPSInfo.GPSLatitudeRef"),
                    east = TextOf(data, "Exif.GPSInfo.GPSLongitudeRef");
  const bool has_sides = (north == "N" || north == "S") && (east == "E" || east == "W");
  if (!latitude || !longitude || !has_sides || *latitude > 90 || *longitude > 180)
    return std::nullopt;
  if (*latitude == 0 && *longitude == 0) return std::nullopt;
  GpsFix fix;
  fix.latitude_deg = north == "S" ? -*latitude : *latitude;
  fix.longitude_deg = east == "W" ? -*longitude : *longitude;
  fix.accuracy_m = NumberOf(data, "Exif.GPSInfo.GPSHPositioningError");
  const auto height = data.findKey(Exiv2::ExifKey("Exif.GPSInfo.GPSAltitude"));
  if (height == data.end() || height->count() != 1) return fix;
  const auto [above, below] = height->toRational(0);
  if (above < 0 || below <= 0) return fix;
  const auto side = data.findKey(Exiv2::ExifKey("Exif.GPSInfo.GPSAltitudeRef"));
  // 1 and 3 are below the sea and the ellipsoid.
  const bool is_below = side != data.end() && side->count() == 1 && side->toLong(0) % 2 == 1;
  const double height_m = static_cast<double>(above) / below;
  if (height_m <= kNumberMax) fix.height_m = is_below ? -height_m : height_m;
  return fix;
}

}  // namespace

ExifCamera ReadExifCamera(std::span<const uint8_t> exif) {
  return ReadExif(exif, ExifCamera(), CameraOf);
}

std::optional<GpsFix> ReadExifGps(std::span<const uint8_t> exif) {
  return ReadExif(exif, std::optional<GpsFix>(), GpsOf);
}

}  // namespace veduta
