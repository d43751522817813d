// SPDX-License-Identifier: Apache-2.0
#include "engine/photo/thumbnail.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace veduta {
namespace {

constexpr int kJpegQuality = 85;  // chosen by hand

}  // namespace

Result<std::vector<uint8_t>> MakeThumbnail(const cv::Mat& bgr, uint32_t side_px) {
  cv::Mat small = bgr;
  const double share = static_cast<double>(side_px) / std::max(bgr.cols, bgr.rows);
  std::vector<uint8_t> jpeg;
  try {
    if (share < 1) {
      const auto scaled = [&](int side) {
        return std::max(1, static_cast<int>(std::lround(share * side)));
      };
      cv::resize(bgr, small, {scaled(bgr.cols), scaled(bgr.rows)}, 0, 0, cv::INTER_AREA);
    }
    if (cv::imencode(".jpg", small, jpeg, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality})) return jpeg;
  } catch (const cv::Exception& error) {
    return Status::IoError(std::string("cannot make a small picture: ") + error.what());
  }
  return Status::IoError("cannot make a small picture: the JPEG encoder gave nothing");
}

}  // namespace veduta
