// SPDX-License-Identifier: Apache-2.0
#include "tools/render/street/gps_tags.h"

#include <cmath>
#include <exiv2/exiv2.hpp>
#include <numbers>

#include "engine/earth/local_frame.h"
#include "storage/base/content_hash.h"

namespace veduta::street {
namespace {

Eigen::Vector3d DrawNormal(uint64_t seed) {
  SeededRandom random(seed);
  Eigen::Vector3d drawn;
  for (int axis = 0; axis < 3; ++axis) {
    const double radius = std::sqrt(-2 * std::log(1 - random.Unit()));
    drawn[axis] = radius * std::cos(2 * std::numbers::pi * random.Unit());
  }
  return drawn;
}

Exiv2::URational Thousandths(double number) {
  return {static_cast<uint32_t>(std::lround(number * 1000)), 1000};
}

// Degrees, minutes, and seconds to 3 mm.
Exiv2::URationalValue AngleOf(double degrees) {
  constexpr double kSteps = 10'000;
  const auto steps = static_cast<uint64_t>(std::llround(std::abs(degrees) * 3600 * kSteps));
  const auto seconds = static_cast<uint32_t>(steps % (60 * 10'000));
  const uint64_t minutes = steps / (60 * 10'000);
  Exiv2::URationalValue value;
  value.value_ = {{static_cast<uint32_t>(minutes / 60), 1},
                  {static_cast<uint32_t>(minutes % 60), 1},
                  {seconds, static_cast<uint32_t>(kSteps)}};
  return value;
}

}  // namespace

Eigen::Vector3d ReceivedPosition(const Eigen::Vector3d& center_m, double deviation_m, uint64_t seed,
                                 uint64_t photo) {
  const Eigen::Vector3d common = DrawNormal(MixSeed(seed, 0)),
                        own = DrawNormal(MixSeed(seed, photo + 1));
  const Eigen::Vector3d deviation(deviation_m, deviation_m, 2 * deviation_m);
  return center_m + deviation.cwiseProduct(common + own) / std::numbers::sqrt2;
}

GpsFix FixAt(const Eigen::Vector3d& position_m, double accuracy_m) {
  const GeoPosition position = LocalFrame(kStreetOrigin).ToGeo(position_m);
  return {position.latitude_deg, position.longitude_deg, position.height_m, accuracy_m, {}};
}

Result<std::vector<uint8_t>> WithGpsTags(std::span<const uint8_t> jpeg, const GpsFix& fix) {
  try {
    Exiv2::ExifData data;
    data["Exif.GPSInfo.GPSVersionID"] = "2 3 0 0";
    data["Exif.GPSInfo.GPSLatitudeRef"] = fix.latitude_deg < 0 ? "S" : "N";
    data["Exif.GPSInfo.GPSLongitudeRef"] = fix.longitude_deg < 0 ? "W" : "E";
    const Exiv2::URationalValue latitude = AngleOf(fix.latitude_deg),
                                longitude = AngleOf(fix.longitude_deg);
    data.add(Exiv2::ExifKey("Exif.GPSInfo.GPSLatitude"), &latitude);
    data.add(Exiv2::ExifKey("Exif.GPSInfo.GPSLongitude"), &longitude);
    if (fix.height_m) {
      data["Exif.GPSInfo.GPSAltitudeRef"] = *fix.height_m < 0 ? "1" : "0";
      data["Exif.GPSInfo.GPSAltitude"] = Thousandths(std::abs(*fix.height_m));
    }
    if (fix.accuracy_m > 0) data["Exif.GPSInfo.GPSHPositioningError"] = Thousandths(fix.accuracy_m);
    const auto image = Exiv2::ImageFactory::open(jpeg.data(), static_cast<long>(jpeg.size()));
    image->setExifData(data);
    image->writeMetadata();
    Exiv2::BasicIo& written = image->io();
    written.seek(0, Exiv2::BasicIo::beg);
    const Exiv2::DataBuf bytes = written.read(static_cast<long>(written.size()));
    return std::vector<uint8_t>(bytes.pData_, bytes.pData_ + bytes.size_);
  } catch (const std::exception& error) {
    return Status::IoError(std::string("cannot write EXIF: ") + error.what());
  }
}

}  // namespace veduta::street
