// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/exif.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <exiv2/exiv2.hpp>
#include <mutex>
#include <string_view>
#include <utility>
#include <vector>

#include "engine/camera/sensor_sizes.h"

namespace veduta {
namespace {

constexpr size_t kTextSizeMax = 64;    // longer ones are no names
constexpr double kNumberMax = 10'000;  // no lens has so many mm, no fix is worth so many m
const double kFilmDiagonalMm = std::hypot(36, 24);
constexpr double kSensorMmMin = 1, kSensorMmMax = 100, kPixelsMax = 1e6;

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

// The n-th of its rationals, above and below. Of unsigned ones exiv2's own conversion loses those
// of 2^31 and more.
std::pair<int64_t, int64_t> RationalAt(const Exiv2::Exifdatum& datum, long n) {
  const auto* const whole = dynamic_cast<const Exiv2::ValueType<Exiv2::URational>*>(&datum.value());
  if (whole != nullptr) return whole->value_.at(static_cast<size_t>(n));
  return datum.toRational(n);
}

double NumberOf(const Exiv2::ExifData& data, const char* key, double number_max = kNumberMax) {
  const auto found = data.findKey(Exiv2::ExifKey(key));
  if (found == data.end() || found->count() == 0) return 0;
  const auto [above, below] = RationalAt(*found, 0);
  if (above <= 0 || below <= 0) return 0;
  const double number = static_cast<double>(above) / static_cast<double>(below);
  return number <= number_max ? number : 0;
}

// Of Exif.Photo.FocalPlaneResolutionUnit; 0 for any other. The last two are not in the standard.
double UnitMm(double unit) {
  if (unit == 3) return 10;
  if (unit == 4) return 1;
  if (unit == 5) return 0.001;
  return unit == 0 || unit == 2 ? 25.4 : 0;
}

// The 35 mm equivalent of a photo that shows so much of the sensor.
double EquivalentOf(const ExifCamera& camera, double width_mm, double height_mm) {
  const double equivalent_mm = camera.focal_mm * std::max(1.0, camera.digital_zoom) *
                               kFilmDiagonalMm / std::hypot(width_mm, height_mm);
  return equivalent_mm <= kNumberMax ? equivalent_mm : 0;
}

// By how many pixels of the photo, as it was taken, the sensor has in a millimetre; 0 where that is
// not told, or makes no sense.
double EquivalentBySensor(const Exiv2::ExifData& data, const ExifCamera& camera) {
  const double unit_mm = UnitMm(NumberOf(data, "Exif.Photo.FocalPlaneResolutionUnit"));
  const auto side_mm = [&](const char* pixels, const char* resolution) {
    const double per_unit = NumberOf(data, resolution, kPixelsMax);
    return per_unit > 0 ? NumberOf(data, pixels, kPixelsMax) / per_unit * unit_mm : 0;
  };
  const double width_mm = side_mm("Exif.Photo.PixelXDimension", "Exif.Photo.FocalPlaneXResolution"),
               height_mm =
                   side_mm("Exif.Photo.PixelYDimension", "Exif.Photo.FocalPlaneYResolution");
  const auto makes_sense = [](double mm) { return mm >= kSensorMmMin && mm <= kSensorMmMax; };
  if (!makes_sense(width_mm) || !makes_sense(height_mm)) return 0;
  return EquivalentOf(camera, width_mm, height_mm);
}

// By how large the sensor of such a camera is known to be; 0 where it is not. A photo that is wider
// or narrower than the sensor is cut out of it.
double EquivalentByModel(const Exiv2::ExifData& data, const ExifCamera& camera) {
  const auto sensor = FindSensorSize(camera.make, camera.model);
  if (!sensor) return 0;
  const double width_px = NumberOf(data, "Exif.Photo.PixelXDimension", kPixelsMax),
               height_px = NumberOf(data, "Exif.Photo.PixelYDimension", kPixelsMax);
  const double sensor_ratio = sensor->width_mm / sensor->height_mm;
  const double ratio = width_px > 0 && height_px > 0
                           ? std::max(width_px, height_px) / std::min(width_px, height_px)
                           : sensor_ratio;
  return EquivalentOf(camera, sensor->width_mm * std::min(1.0, ratio / sensor_ratio),
                      sensor->height_mm * std::min(1.0, sensor_ratio / ratio));
}

// Degrees, minutes and seconds as one number; nothing where it is none.
std::optional<double> DegreesOf(const Exiv2::ExifData& data, const char* key) {
  const auto found = data.findKey(Exiv2::ExifKey(key));
  if (found == data.end() || found->count() < 1 || found->count() > 3) return std::nullopt;
  double degrees = 0, unit = 1;
  for (long i = 0; i < found->count(); ++i, unit /= 60) {
    const auto [above, below] = RationalAt(*found, i);
    // Some leave minutes or seconds out as 0/0.
    if (i > 0 && above == 0 && below == 0) continue;
    if (above < 0 || below <= 0) return std::nullopt;
    degrees += unit * static_cast<double>(above) / static_cast<double>(below);
  }
  return degrees;
}

// Of exiv2, which keeps tables of its own.
std::mutex& ExivMutex() {
  static std::mutex mutex;
  return mutex;
}

// What read(data) makes of a block; `none` where it is broken.
template <typename Value, typename Read>
Value ReadExif(std::span<const uint8_t> exif, Value none, const Read& read) {
  const std::lock_guard lock(ExivMutex());
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
  camera.focal_35mm = NumberOf(data, "Exif.Photo.FocalLengthIn35mmFilm");
  if (camera.focal_35mm == 0) camera.focal_35mm = EquivalentBySensor(data, camera);
  if (camera.focal_35mm == 0) camera.focal_35mm = EquivalentByModel(data, camera);
  const double width_px = NumberOf(data, "Exif.Photo.PixelXDimension", kPixelsMax),
               height_px = NumberOf(data, "Exif.Photo.PixelYDimension", kPixelsMax);
  if (width_px >= 1 && height_px >= 1) {
    camera.taken_width_px = static_cast<uint32_t>(width_px);
    camera.taken_height_px = static_cast<uint32_t>(height_px);
  }
  return camera;
}

// Whether positions are on WGS 84, or on a datum that lies within some metres of it all over the
// land that it is of. Cameras write the name as they like. Tokyo's lies 400 m off, and Europe's of
// 1950 100 m. A photo that names none is taken to mean WGS 84, which EXIF's own notes ask for.
bool IsNearWgs84(const std::string& datum) {
  constexpr std::array<std::string_view, 11> kNear = {
      "WGS84",   "WGS1984", "ETRS89",   "NAD83",    "GDA94",     "GDA2020",
      "JGD2000", "JGD2011", "CGCS2000", "NZGD2000", "SIRGAS2000"};
  std::string name;
  for (const char c : datum) {
    if (c >= 'a' && c <= 'z') name += static_cast<char>(c - 'a' + 'A');
    if ((c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9')) name += c;
  }
  return name.empty() || std::ranges::find(kNear, name) != kNear.end();
}

// A receiver that says so knows nothing.
bool IsOffByMore(const Exiv2::ExifData& data, double error_m) {
  const auto found = data.findKey(Exiv2::ExifKey("Exif.GPSInfo.GPSHPositioningError"));
  return found != data.end() && found->count() > 0 && found->toFloat(0) > error_m;
}

// Whatever the datum is, and how far off the receiver says to be.
std::optional<GpsFix> PositionOf(const Exiv2::ExifData& data) {
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
  const auto [above, below] = RationalAt(*height, 0);
  if (above < 0 || below <= 0) return fix;
  const auto side = data.findKey(Exiv2::ExifKey("Exif.GPSInfo.GPSAltitudeRef"));
  // 1 and 3 are below the sea and the ellipsoid.
  const bool is_below = side != data.end() && side->count() == 1 && side->toLong(0) % 2 == 1;
  const double height_m = static_cast<double>(above) / static_cast<double>(below);
  if (height_m <= kNumberMax) fix.height_m = is_below ? -height_m : height_m;
  return fix;
}

// By the true north. Compasses show the magnetic one, which lies up to 20 degrees off where people
// live, and nothing here knows by how much.
std::optional<double> HeadingOf(const Exiv2::ExifData& data) {
  if (TextOf(data, "Exif.GPSInfo.GPSImgDirectionRef") != "T") return std::nullopt;
  const auto found = data.findKey(Exiv2::ExifKey("Exif.GPSInfo.GPSImgDirection"));
  if (found == data.end() || found->count() != 1) return std::nullopt;
  const auto [above, below] = RationalAt(*found, 0);
  if (above < 0 || below <= 0) return std::nullopt;
  const double heading_deg = static_cast<double>(above) / static_cast<double>(below);
  if (heading_deg > 360) return std::nullopt;
  return heading_deg == 360 ? 0 : heading_deg;
}

std::optional<GpsFix> GpsOf(const Exiv2::ExifData& data) {
  if (!IsNearWgs84(TextOf(data, "Exif.GPSInfo.GPSMapDatum"))) return std::nullopt;
  if (IsOffByMore(data, kNumberMax)) return std::nullopt;
  std::optional<GpsFix> fix = PositionOf(data);
  if (fix) fix->heading_deg = HeadingOf(data);
  return fix;
}

// The numbers of a text of this shape, where # is a digit; nothing for any other text.
std::optional<std::vector<int>> NumbersOf(std::string_view text, std::string_view shape) {
  if (text.size() != shape.size()) return std::nullopt;
  std::vector<int> numbers;
  for (size_t i = 0; i < shape.size(); ++i) {
    const bool is_digit = text[i] >= '0' && text[i] <= '9';
    if (shape[i] == '#' ? !is_digit : text[i] != shape[i]) return std::nullopt;
    if (!is_digit) continue;
    if (i == 0 || shape[i - 1] != '#') numbers.push_back(0);
    numbers.back() = 10 * numbers.back() + (text[i] - '0');
  }
  return numbers;
}

std::optional<int32_t> OffsetOf(const std::string& text) {
  if (text.empty() || (text[0] != '+' && text[0] != '-')) return std::nullopt;
  const auto read = NumbersOf(std::string_view(text).substr(1), "##:##");
  if (!read || (*read)[1] > 59) return std::nullopt;
  const int32_t offset_s = (text[0] == '-' ? -60 : 60) * (60 * (*read)[0] + (*read)[1]);
  if (offset_s < kTakenOffsetSMin || offset_s > kTakenOffsetSMax) return std::nullopt;
  return offset_s;
}

std::optional<TakenTime> TakenOf(const Exiv2::ExifData& data) {
  const auto read = NumbersOf(TextOf(data, "Exif.Photo.DateTimeOriginal"), "####:##:## ##:##:##");
  if (!read) return std::nullopt;
  const std::chrono::year_month_day day(std::chrono::year((*read)[0]),
                                        std::chrono::month(static_cast<unsigned>((*read)[1])),
                                        std::chrono::day(static_cast<unsigned>((*read)[2])));
  const int hours = (*read)[3], minutes = (*read)[4], seconds = (*read)[5];
  if (!day.ok() || hours > 23 || minutes > 59 || seconds > 59) return std::nullopt;
  TakenTime taken;
  taken.local_unix_s = std::chrono::seconds(std::chrono::sys_days(day).time_since_epoch()).count() +
                       3600 * hours + 60 * minutes + seconds;
  if (taken.local_unix_s < kTakenUnixSMin) return std::nullopt;
  taken.offset_s = OffsetOf(TextOf(data, "Exif.Photo.OffsetTimeOriginal"));
  return taken;
}

Exiv2::URational RationalOf(double number, uint32_t parts) {
  return {static_cast<uint32_t>(std::llround(number * parts)), parts};
}

void PutText(Exiv2::ExifData* data, const char* key, const std::string& text) {
  if (!text.empty()) (*data)[key] = text;
}

void PutNumber(Exiv2::ExifData* data, const char* key, double number) {
  // Four thousand millionths are the most that a rational has room for.
  if (number > 0) (*data)[key] = RationalOf(number, number < 4000 ? 1'000'000 : 100'000);
}

void PutDegrees(Exiv2::ExifData* data, const char* key, double degrees) {
  const double whole = std::floor(degrees), minutes = (degrees - whole) * 60;
  Exiv2::URationalValue value;
  value.value_.emplace_back(static_cast<uint32_t>(whole), 1);
  value.value_.emplace_back(static_cast<uint32_t>(minutes), 1);
  value.value_.push_back(RationalOf((minutes - std::floor(minutes)) * 60, 10'000'000));
  data->add(Exiv2::ExifKey(key), &value);
}

void PutGps(Exiv2::ExifData* data, const GpsFix& fix) {
  (*data)["Exif.GPSInfo.GPSLatitudeRef"] = fix.latitude_deg < 0 ? "S" : "N";
  (*data)["Exif.GPSInfo.GPSLongitudeRef"] = fix.longitude_deg < 0 ? "W" : "E";
  PutDegrees(data, "Exif.GPSInfo.GPSLatitude", std::abs(fix.latitude_deg));
  PutDegrees(data, "Exif.GPSInfo.GPSLongitude", std::abs(fix.longitude_deg));
  PutNumber(data, "Exif.GPSInfo.GPSHPositioningError", fix.accuracy_m);
  if (fix.heading_deg) {
    (*data)["Exif.GPSInfo.GPSImgDirectionRef"] = "T";
    (*data)["Exif.GPSInfo.GPSImgDirection"] = RationalOf(*fix.heading_deg, 1'000'000);
  }
  if (!fix.height_m) return;
  const Exiv2::byte side = *fix.height_m < 0 ? 1 : 0;
  const Exiv2::DataValue below(&side, 1, Exiv2::littleEndian, Exiv2::unsignedByte);
  data->add(Exiv2::ExifKey("Exif.GPSInfo.GPSAltitudeRef"), &below);
  (*data)["Exif.GPSInfo.GPSAltitude"] = RationalOf(std::abs(*fix.height_m), 100'000);
}

void PutTaken(Exiv2::ExifData* data, const TakenTime& taken) {
  const std::chrono::sys_seconds time{std::chrono::seconds(taken.local_unix_s)};
  const std::chrono::year_month_day day(std::chrono::floor<std::chrono::days>(time));
  const std::chrono::hh_mm_ss clock(time - std::chrono::floor<std::chrono::days>(time));
  char text[64];
  std::snprintf(text, sizeof(text), "%04d:%02u:%02u %02d:%02d:%02d", static_cast<int>(day.year()),
                static_cast<unsigned>(day.month()), static_cast<unsigned>(day.day()),
                static_cast<int>(clock.hours().count()), static_cast<int>(clock.minutes().count()),
                static_cast<int>(clock.seconds().count()));
  (*data)["Exif.Photo.DateTimeOriginal"] = text;
  if (!taken.offset_s) return;
  const int minutes = std::abs(*taken.offset_s) / 60;
  std::snprintf(text, sizeof(text), "%c%02d:%02d", *taken.offset_s < 0 ? '-' : '+', minutes / 60,
                minutes % 60);
  (*data)["Exif.Photo.OffsetTimeOriginal"] = text;
}

}  // namespace

std::vector<uint8_t> WriteExif(const ExifCamera& camera, const std::optional<GpsFix>& gps,
                               const std::optional<TakenTime>& taken, int orientation) {
  const std::lock_guard lock(ExivMutex());
  try {
    Exiv2::LogMsg::setLevel(Exiv2::LogMsg::mute);
    Exiv2::ExifData data;
    data["Exif.Image.Orientation"] = static_cast<uint16_t>(orientation);
    PutText(&data, "Exif.Image.Make", camera.make);
    PutText(&data, "Exif.Image.Model", camera.model);
    PutText(&data, "Exif.Photo.LensModel", camera.lens);
    PutNumber(&data, "Exif.Photo.FocalLength", camera.focal_mm);
    PutNumber(&data, "Exif.Photo.DigitalZoomRatio", camera.digital_zoom);
    if (camera.focal_35mm > 0) {
      data["Exif.Photo.FocalLengthIn35mmFilm"] =
          static_cast<uint16_t>(std::lround(camera.focal_35mm));
    }
    if (camera.taken_width_px > 0) {
      data["Exif.Photo.PixelXDimension"] = camera.taken_width_px;
      data["Exif.Photo.PixelYDimension"] = camera.taken_height_px;
    }
    if (gps) PutGps(&data, *gps);
    if (taken) PutTaken(&data, *taken);
    Exiv2::Blob block;
    Exiv2::ExifParser::encode(block, Exiv2::littleEndian, data);
    return {block.begin(), block.end()};
  } catch (const std::exception&) {
    return {};
  }
}

ExifCamera ReadExifCamera(std::span<const uint8_t> exif) {
  return ReadExif(exif, ExifCamera(), CameraOf);
}

std::optional<GpsFix> ReadExifGps(std::span<const uint8_t> exif) {
  return ReadExif(exif, std::optional<GpsFix>(), GpsOf);
}

bool HoldsExifGps(std::span<const uint8_t> exif, const GpsFix& fix) {
  return ReadExif(exif, false, [&](const Exiv2::ExifData& data) {
    std::optional<GpsFix> held = PositionOf(data);
    if (held && fix.heading_deg) held->heading_deg = HeadingOf(data);
    return held == fix;
  });
}

std::optional<TakenTime> ReadExifTaken(std::span<const uint8_t> exif) {
  return ReadExif(exif, std::optional<TakenTime>(), TakenOf);
}

}  // namespace veduta
