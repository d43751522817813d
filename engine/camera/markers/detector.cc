// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/markers/detector.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>
#include <string>

#include "engine/camera/markers/board.h"
#include "engine/camera/markers/outline.h"
#include "engine/camera/markers/ring.h"

namespace veduta {
namespace {

constexpr int kLevelSidePxMin = 40;

// The residuals of neighbouring pixels are not independent (JPEG, tone curve), and no model is
// exact: measured on rendered photos by veduta-bench-markers, where these make errors and sigmas
// agree.
constexpr double kSigmaFactor = 0.7;
constexpr double kSigmaFloorPx = 0.008;

// From a photo halved `level` times to the photo.
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

// Whether the outline is that of a marker already found: found in the finer image it is better
// there.
bool IsKnown(const std::vector<MarkerDetection>& found, const Ellipse& outline) {
  return std::any_of(found.begin(), found.end(), [&](const MarkerDetection& marker) {
    const double size = std::sqrt(marker.outline.major * marker.outline.minor);
    const double ratio = std::sqrt(outline.major * outline.minor) / size;
    return (marker.outline.center - outline.center).norm() < 0.3 * marker.outline.minor &&
           ratio > 0.7 && ratio < 1.4;
  });
}

// The marker's frame to the level's image: the outline and the board's corner say all but the turn,
// the board that.
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
  const auto refused = [](const char* name, double value, const char* bounds) {
    return Status::InvalidArgument("marker option " + std::string(name) + " = " +
                                   std::to_string(value) + " is not in " + bounds);
  };
  if (offset_gray < 1 || offset_gray > 100) return refused("offset_gray", offset_gray, "[1, 100]");
  if (code_budget < 0 || code_budget > 6) return refused("code_budget", code_budget, "[0, 6]");
  if (!(support_min >= 0.5 && support_min <= 1))
    return refused("support_min", support_min, "[0.5, 1]");
  if (id_count < 1 || id_count > kMarkerIdCount) return refused("id_count", id_count, "[1, 178]");
  if (!(sigma_px_max > 0)) return refused("sigma_px_max", sigma_px_max, "(0, inf)");
  return Status::Ok();
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
    // An odd last row or column is left out: the scale is 2 exactly.
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
