// SPDX-License-Identifier: Apache-2.0
// ReadPhotoHeader, with the EXIF block inside: sizes and orientation, before anything is decoded;
// and what the block says of the camera and of where it was.
#include <cmath>

#include "engine/camera/exif.h"
#include "engine/camera/photo_header.h"
#include "tests/engine/camera/photo_writer.h"
#include "tests/engine/camera/tiff_writer.h"
#include "tools/fuzz/fuzz_target.h"

namespace veduta::fuzz {

std::vector<std::string> Seeds() {
  const cv::Mat picture = testing::TestPicture(8, 6);
  std::vector<std::string> seeds = {Text(testing::PngFile(picture, true, 8)),
                                    Text(testing::TiffFile(picture, testing::TiffKind()))};
  for (const bool is_little_endian : {false, true}) {
    seeds.push_back(Text(
        testing::WithExif(testing::JpegFile(picture), testing::ExifBlock(6, is_little_endian))));
  }
  return seeds;
}

}  // namespace veduta::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using veduta::fuzz::Expect;
  const veduta::PhotoHeader header = veduta::ReadPhotoHeader({data, size});
  const bool is_read = header.outcome == veduta::HeaderOutcome::kRead;
  Expect(is_read == header.detail.empty(), "there is a reason where the header is not read");
  Expect(header.orientation >= 1 && header.orientation <= 8, "an orientation is one of EXIF's");
  Expect(!is_read || (header.stored_size.width_px > 0 && header.stored_size.height_px > 0),
         "a header that is read has a size");
  const veduta::ExifCamera camera = veduta::ReadExifCamera(header.exif);
  Expect(camera.model.size() <= 64 && camera.focal_mm >= 0, "what is senseless is absent");
  const auto gps = veduta::ReadExifGps(header.exif);
  Expect(!gps || (std::abs(gps->latitude_deg) <= 90 && std::abs(gps->longitude_deg) <= 180 &&
                  gps->accuracy_m >= 0 && gps->heading_deg.value_or(0) >= 0 &&
                  gps->heading_deg.value_or(0) < 360),
         "a place that is told lies on the earth");
  const auto taken = veduta::ReadExifTaken(header.exif);
  Expect(!taken || (taken->local_unix_s >= veduta::kTakenUnixSMin &&
                    taken->local_unix_s <= veduta::kTakenUnixSMax),
         "a time that is told can be kept");
  return 0;
}
