// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/markers/detector.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>

#include "engine/camera/markers/board.h"
#include "engine/camera/markers/outline.h"
#include "engine/camera/markers/ring.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// px. Copies of the photo whose shorter side is smaller are not searched. Chosen by hand; not
// measured.
constexpr int kLevelSidePxMin = 40;

// The residuals of neighbouring pixels are not independent (JPEG and the tone curve join them), and
// no model is exact. With these two numbers errors and sigmas agree on the rendered photos of
// veduta-bench-markers.
constexpr double kSigmaFactor = 0.7;
constexpr double kSigmaFloorPx = 0.008;

// A copy of the photo, halved `index` times, and the way back from its pixels to the photo's.
struct Level {
  int index;
  cv::Mat gray;

  double scale() const { return std::ldexp(1.0, index); }
  Eigen::Matrix3d PhotoFromLevel() const {
    const double shift = 0.5 * scale() - 0.5;
    Eigen::Matrix3d map = Eigen::Matrix3d::Identity();
    map.topLeftCorner<2, 2>() *= scale();
    map.topRightCorner<2, 1>().setConstant(shift);
    return map;
  }
  Ellipse InPhoto(Ellipse ellipse) const {
    ellipse.center = ellipse.center * scale() + Eigen::Vector2d::Constant(0.5 * scale() - 0.5);
    ellipse.major *= scale();
    ellipse.minor *= scale();
    return ellipse;
  }
};

// Whether the outline is that of a marker already found. Finer copies are looked at first, and what
// is found there is better. The limits are chosen by hand; not measured.
bool IsKnown(const std::vector<MarkerDetection>& found, const Ellipse& outline) {
  return std::any_of(found.begin(), found.end(), [&](const MarkerDetection& marker) {
    const double size = std::sqrt(marker.outline.major * marker.outline.minor);
    const double ratio = std::sqrt(outline.major * outline.minor) / size;
    return (marker.outline.center - outline.center).norm() < 0.3 * marker.outline.minor &&
           ratio > 0.7 && ratio < 1.4;
  });
}

// From the marker's frame to the level's image. The outline and the board's corner tell all but the
// turn about the corner, and the board's axes tell the turn.
Eigen::Matrix3d FrameOf(const Ellipse& outline, const BoardPose& board) {
  const Eigen::Matrix3d circle = HomographyFromCircle(outline, outline.At(board.center_unit));
  const Eigen::Vector2d axis(std::cos(board.angle_rad), std::sin(board.angle_rad));
  const Eigen::Vector2d ahead = outline.At(board.center_unit + 0.3 * axis);
  const Eigen::Vector2d unit = (circle.inverse() * ahead.homogeneous()).hnormalized();
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  turn.topLeftCorner<2, 2>() =
      Eigen::Rotation2Dd(std::atan2(unit.y(), unit.x())).toRotationMatrix();
  return circle * turn;
}

// Examines one outline.
std::optional<MarkerDetection> Look(const cv::Mat& photo, const Level& level,
                                    const Ellipse& candidate, const MarkerOptions& options) {
  const std::optional<Outline> outline = RefineOutline(level.gray, candidate);
  if (!outline || outline->support < options.support_min) return std::nullopt;
  const std::optional<BoardPose> board =
      FindBoard(level.gray, outline->ellipse, outline->contrast_gray);
  if (!board) return std::nullopt;
  const Eigen::Matrix3d frame = FrameOf(outline->ellipse, *board);
  const std::optional<RingReading> ring = ReadRing(level.gray, frame, options.code_budget);
  if (!ring || ring->id >= options.id_count) return std::nullopt;
  const std::optional<BoardFit> fit =
      // 0.8 px of the copy, the blur to start with, is chosen by hand; not measured.
      AlignBoard(photo, level.PhotoFromLevel() * frame, 0.8 * level.scale());
  if (!fit) return std::nullopt;
  MarkerDetection marker;
  marker.id = ring->id;
  marker.center_px = fit->center_px;
  marker.covariance_px2 = kSigmaFactor * kSigmaFactor * fit->covariance_px2 +
                          kSigmaFloorPx * kSigmaFloorPx * Eigen::Matrix2d::Identity();
  marker.outline = level.InPhoto(outline->ellipse);
  marker.blur_px = fit->blur_px;
  marker.error_count = ring->error_count;
  marker.erasure_count = ring->erasure_count;
  if (!(marker.SigmaPx() <= options.sigma_px_max)) return std::nullopt;
  return marker;
}

void DropAmbiguous(MarkerSearch* search) {
  std::map<MarkerId, int> counts;
  for (const MarkerDetection& marker : search->markers) ++counts[marker.id];
  std::erase_if(search->markers,
                [&](const MarkerDetection& marker) { return counts[marker.id] > 1; });
  for (const auto& [id, count] : counts) {
    if (count > 1) search->ambiguous.push_back(id);
  }
  std::sort(search->markers.begin(), search->markers.end(),
            [](const auto& a, const auto& b) { return a.id < b.id; });
}

}  // namespace

Status MarkerOptions::Check() const {
  return OptionBounds()
      .Between("offset_gray", offset_gray, 1, 100)
      .Between("code_budget", code_budget, 0, kMarkerDistanceMin - 1)
      .Between("support_min", support_min, 0.5, 1)
      .Between("id_count", id_count, 1, kMarkerIdCount)
      .FiniteAbove("sigma_px_max", sigma_px_max, 0)
      .status();
}

double MarkerDetection::SigmaPx() const {
  return std::sqrt(0.5 * covariance_px2.trace());
}

Result<MarkerSearch> DetectMarkers(const cv::Mat& gray, const MarkerOptions& options) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  if (gray.type() != CV_8UC1 && !gray.empty()) {
    return Status::InvalidArgument("markers are looked for in grey images of 8 bits");
  }
  MarkerSearch search;
  Level level = {0, gray};
  while (std::min(level.gray.rows, level.gray.cols) >= kLevelSidePxMin) {
    for (const Ellipse& candidate : FindOutlines(level.gray, options.offset_gray)) {
      ++search.outline_count;
      if (IsKnown(search.markers, level.InPhoto(candidate))) continue;
      if (auto marker = Look(gray, level, candidate, options)) {
        if (!IsKnown(search.markers, marker->outline)) search.markers.push_back(std::move(*marker));
      }
    }
    // An odd last row or column is left out, so that the scale is exactly 2.
    const cv::Size size(level.gray.cols / 2, level.gray.rows / 2);
    cv::Mat half;
    cv::resize(level.gray({0, 0, 2 * size.width, 2 * size.height}), half, size, 0, 0,
               cv::INTER_AREA);
    level = {level.index + 1, std::move(half)};
  }
  DropAmbiguous(&search);
  return search;
}

}  // namespace veduta
