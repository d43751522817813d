// SPDX-License-Identifier: Apache-2.0
// What the detector does with files that are no calibration photos, and what it sees in those that
// are.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "engine/camera/markers/outline.h"
#include "storage/base/content_hash.h"
#include "tools/bench/markers/bench.h"
#include "tools/bench/markers/photo_file.h"

namespace veduta::floor {
namespace {

cv::Point2d ToPoint(const Eigen::Vector2d& px) {
  return {px.x(), px.y()};
}

void DrawEllipse(cv::Mat* image, const Ellipse& ellipse, const cv::Scalar& color, int thickness) {
  constexpr int kShift = 4;
  const auto fixed = [&](const Eigen::Vector2d& px) {
    return cv::Point(static_cast<int>(px.x() * (1 << kShift)),
                     static_cast<int>(px.y() * (1 << kShift)));
  };
  std::vector<cv::Point> points;
  for (int i = 0; i < 72; ++i) {
    const double angle = i * 5 * CV_PI / 180;
    points.push_back(fixed(ellipse.At(Eigen::Vector2d(std::cos(angle), std::sin(angle)))));
  }
  cv::polylines(*image, points, true, color, thickness, cv::LINE_AA, kShift);
}

// One change of a damaged file: a byte, a bit, a run, an insertion, or the end cut off.
void Mutate(SeededRandom* random, std::vector<uint8_t>* bytes) {
  const auto size = static_cast<uint32_t>(bytes->size());
  const uint32_t at = random->Below(random->Below(3) == 0 ? std::min(size, 700u) : size);
  switch (random->Below(6)) {
    case 0:
      (*bytes)[at] = static_cast<uint8_t>(random->Below(256));
      break;
    case 1:
      (*bytes)[at] ^= static_cast<uint8_t>(1u << random->Below(8));
      break;
    case 2:
      for (uint32_t i = at; i < std::min(size, at + 1 + random->Below(64)); ++i) {
        (*bytes)[i] = static_cast<uint8_t>(random->Below(256));
      }
      break;
    case 3:
      bytes->insert(bytes->begin() + at, static_cast<uint8_t>(random->Below(256)));
      break;
    case 4:
      bytes->erase(bytes->begin() + at);
      break;
    default:
      if (random->Below(4) == 0) bytes->resize(at + 1);
  }
}

}  // namespace

int RunFalse(const std::vector<std::string>& paths) {
  uint64_t photos = 0, megapixels1000 = 0, outlines = 0, wrong = 0;
  for (const std::string& path : PhotosBelow(paths)) {
    const DecodedPhoto photo = ReadPhoto(path);
    if (photo.gray.empty()) continue;
    // As it is, twice as large and inverted: other textures at other sizes.
    cv::Mat larger;
    cv::resize(photo.gray, larger, {}, 2, 2, cv::INTER_LINEAR);
    for (const cv::Mat& gray : {photo.gray, larger, cv::Mat(255 - photo.gray)}) {
      const auto search = DetectMarkers(gray);
      ++photos;
      megapixels1000 += gray.total() / 1000;
      outlines += search->outline_count;
      wrong += search->markers.size() + search->ambiguous.size();
      for (const MarkerDetection& marker : search->markers) {
        std::printf("%s: id %u at %.1f %.1f, %.0f px across, %d errors, %d erasures\n",
                    path.c_str(), marker.id, marker.center_px.x(), marker.center_px.y(),
                    2 * marker.outline.major, marker.error_count, marker.erasure_count);
      }
    }
  }
  std::printf("%lu images, %.1f megapixels, %lu outlines looked at: %lu ids\n", photos,
              megapixels1000 / 1000.0, outlines, wrong);
  return 0;
}

int RunDraw(const std::string& path, const std::string& out, bool is_inverted) {
  const DecodedPhoto photo = ReadPhoto(path);
  if (photo.gray.empty()) {
    std::fprintf(stderr, "veduta-bench-markers: %s: %s\n", path.c_str(), photo.detail.c_str());
    return 1;
  }
  const cv::Mat gray = is_inverted ? cv::Mat(255 - photo.gray) : photo.gray;
  const auto search = DetectMarkers(gray);
  cv::Mat image = photo.bgr.clone();
  const int thickness = std::max(1, image.cols / 1000);
  for (const Ellipse& outline : FindOutlines(gray, MarkerOptions{}.offset_gray)) {
    if (const auto refined = RefineOutline(gray, outline)) {
      DrawEllipse(&image, refined->ellipse, {255, 160, 0}, thickness);
    }
  }
  for (const MarkerDetection& marker : search->markers) {
    DrawEllipse(&image, marker.outline, {0, 200, 0}, 2 * thickness);
    cv::drawMarker(image, ToPoint(marker.center_px), {0, 0, 255}, cv::MARKER_CROSS, 14 * thickness,
                   thickness);
    cv::putText(image, std::to_string(marker.id),
                ToPoint(marker.center_px + Eigen::Vector2d(4, -4)), cv::FONT_HERSHEY_SIMPLEX,
                0.6 * thickness, {0, 0, 255}, thickness, cv::LINE_AA);
  }
  std::printf("%s: %u outlines, %zu markers, %zu ids seen twice\n", path.c_str(),
              search->outline_count, search->markers.size(), search->ambiguous.size());
  return cv::imwrite(out, image) ? 0 : 1;
}

int RunMutations(const std::vector<std::string>& paths, uint32_t count) {
  const std::vector<std::string> photos = PhotosBelow(paths);
  if (photos.empty()) return 1;
  std::vector<std::vector<uint8_t>> files;
  for (const std::string& path : photos) files.push_back(ReadBytes(path));
  DecodeLimits limits;
  limits.pixels_max = 4 << 20;
  uint32_t decoded = 0, markers = 0;
  SeededRandom random(1);
  for (uint32_t i = 0; i < count; ++i) {
    std::vector<uint8_t> bytes = files[i % files.size()];
    for (uint32_t k = 0; k <= random.Below(8) && !bytes.empty(); ++k) Mutate(&random, &bytes);
    const DecodedPhoto photo = DecodePhoto(bytes, limits);
    if (photo.gray.empty()) continue;
    ++decoded;
    markers += static_cast<uint32_t>(DetectMarkers(photo.gray)->markers.size());
  }
  std::printf("%u mutated files of %zu: %u decoded, %u markers found in them\n", count,
              files.size(), decoded, markers);
  return 0;
}

}  // namespace veduta::floor
