// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/filled_photo.h"

#include <turbojpeg.h>

#include <memory>
#include <opencv2/imgproc.hpp>
#include <string_view>

#include "engine/camera/orientation.h"

namespace veduta {
namespace {

constexpr int kQuality = 95;               // chosen by hand; not measured
const cv::Scalar kFilling(128, 128, 128);  // the middle: it says nothing of what was there
constexpr std::string_view kExifMark("Exif\0\0", 6);
constexpr size_t kSegmentBytesMax = 65535;  // ISO/IEC 10918-1, B.1.1.4
constexpr size_t kStartBytes = 2;           // of the JPEG, before its first segment

struct Encoder {
  void operator()(void* handle) const { tjDestroy(handle); }
};

// The segment APP1; empty where there is no block that it has room for.
std::vector<uint8_t> ExifSegment(std::span<const uint8_t> exif) {
  const size_t length = 2 + kExifMark.size() + exif.size();
  if (exif.empty() || length > kSegmentBytesMax) return {};
  std::vector<uint8_t> segment = {0xFF, 0xE1, static_cast<uint8_t>(length >> 8),
                                  static_cast<uint8_t>(length)};
  segment.insert(segment.end(), kExifMark.begin(), kExifMark.end());
  segment.insert(segment.end(), exif.begin(), exif.end());
  return segment;
}

}  // namespace

Result<std::vector<uint8_t>> EncodePicture(const cv::Mat& bgr) {
  const std::unique_ptr<void, Encoder> encoder(tjInitCompress());
  if (encoder == nullptr) return Status::IoError("cannot encode a picture: no JPEG encoder");
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const int failed =
      tjCompress2(encoder.get(), bgr.data, bgr.cols, static_cast<int>(bgr.step[0]), bgr.rows,
                  TJPF_BGR, &bytes, &size, TJSAMP_444, kQuality, TJFLAG_ACCURATEDCT);
  const std::unique_ptr<unsigned char, void (*)(unsigned char*)> owner(bytes, tjFree);
  if (failed != 0)
    return Status::IoError(std::string("cannot encode a picture: ") +
                           tjGetErrorStr2(encoder.get()));
  return std::vector<uint8_t>(bytes, bytes + size);
}

Result<std::vector<uint8_t>> FillPhoto(cv::Mat upright, const PhotoExamination& examined,
                                       std::span<const PixelArea> areas) {
  for (const PixelArea& area : areas)
    upright(cv::Rect(area.x, area.y, area.width, area.height)).setTo(kFilling);
  const int orientation = examined.header.orientation;
  VEDUTA_ASSIGN_OR_RETURN(std::vector<uint8_t> photo,
                          EncodePicture(Upright(upright, InverseOrientation(orientation))));
  std::vector<uint8_t> segments = PrivateAreasSegment(areas);
  const std::vector<uint8_t> exif =
      ExifSegment(WriteExif(examined.camera, examined.gps, examined.taken, orientation));
  segments.insert(segments.end(), exif.begin(), exif.end());
  photo.insert(photo.begin() + kStartBytes, segments.begin(), segments.end());
  return photo;
}

}  // namespace veduta
