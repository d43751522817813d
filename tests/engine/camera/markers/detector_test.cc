// SPDX-License-Identifier: Apache-2.0
// Goal: markers in rendered photos are found with the right id and a feature point far better
//   than the ellipse's centre, whatever slant, light, blur and clutter; no other id is ever
//   said; any image at all gets an answer.
// Method: photos of known truth at the edges of what is promised (tools/markers measures in
//   between); half-covered rings, copies of a marker, noise and degenerate images; damaged
//   files through the decoder.
#include "engine/camera/markers/detector.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <string>

#include "engine/camera/photo_decoder.h"
#include "storage/base/content_hash.h"
#include "storage/base/median.h"
#include "tests/engine/camera/markers/floor_view.h"

namespace veduta {
namespace {

using floor::Flooring;
using floor::FloorOptions;
using floor::FloorPhotoOptions;
using floor::MarkerTruth;
using testing::FloorView;
using testing::TakeFloorView;

struct Score {
  int whole = 0, whole_found = 0, wrong = 0;
  std::vector<double> error_px, ellipse_error_px, chi2;
};

// Where nothing was found it is far from every bound.
double Median(const std::vector<double>& values) {
  return MedianOf(values, 1e9);
}

Score ScoreOf(const FloorView& view, const MarkerSearch& search) {
  Score score;
  for (const MarkerTruth& truth : view.truths) score.whole += truth.is_whole && truth.cover == 0;
  for (const MarkerDetection& marker : search.markers) {
    const auto truth = std::find_if(view.truths.begin(), view.truths.end(),
                                    [&](const MarkerTruth& t) { return t.id == marker.id; });
    if (truth == view.truths.end() || (truth->px - marker.center_px).norm() > 2) {
      ++score.wrong;
      continue;
    }
    const Eigen::Vector2d error = marker.center_px - truth->px;
    score.whole_found += truth->is_whole && truth->cover == 0;
    score.error_px.push_back(error.norm());
    score.ellipse_error_px.push_back((marker.outline.center - truth->px).norm());
    score.chi2.push_back(error.dot(marker.covariance_px2.inverse() * error));
  }
  return score;
}

Score Try(const FloorOptions& floor, double diameter_px, double tilt_deg,
          const FloorPhotoOptions& photo) {
  const FloorView view = TakeFloorView(floor, diameter_px, tilt_deg, photo);
  return ScoreOf(view, DetectMarkers(view.gray).value());
}

FloorOptions Grid(uint32_t markers = 24) {
  FloorOptions options;
  options.is_scattered = false;
  options.flooring = Flooring::kPlain;
  options.marker_count = markers;
  return options;
}

TEST(DetectMarkers, FindsAllWithCentersMuchBetterThanTheEllipse) {
  const Score score = Try(Grid(), 70, 35, {});
  EXPECT_GE(score.whole, 15);
  EXPECT_EQ(score.whole_found, score.whole);
  EXPECT_EQ(score.wrong, 0);
  EXPECT_LT(Median(score.error_px), 0.03);
  EXPECT_GT(Median(score.ellipse_error_px), 10 * Median(score.error_px));
  EXPECT_LT(Median(score.chi2), 3 * 1.39) << "sigmas are honest";
  EXPECT_GT(Median(score.chi2), 1.39 / 6) << "and not timid";
}

TEST(DetectMarkers, FromSmallToLargeAndSlanted) {
  const struct {
    double diameter_px, tilt_deg, found_min;
  } cases[] = {{24, 0, 0.95}, {130, 20, 1}, {330, 30, 1}, {110, 60, 0.9}};
  for (const auto& c : cases) {
    const Score score = Try(Grid(), c.diameter_px, c.tilt_deg, {});
    EXPECT_GE(score.whole, 1);
    EXPECT_GE(score.whole_found, c.found_min * score.whole)
        << c.diameter_px << " px at " << c.tilt_deg;
    EXPECT_EQ(score.wrong, 0);
    EXPECT_LT(Median(score.error_px), 0.08);
  }
}

TEST(DetectMarkers, InBadLightAndBlurredAndAmongPebbles) {
  FloorOptions pebbles = Grid();
  pebbles.flooring = Flooring::kTerrazzo;
  pebbles.cover_count = 15;
  FloorPhotoOptions uneven, blurred, smeared, dark;
  uneven.unevenness = 0.9;
  uneven.vignetting = 0.7;
  blurred.blur_sigma_px = 2;
  smeared.motion_px = 5;
  dark.exposure = 0.1;
  for (const FloorPhotoOptions& photo : {uneven, blurred, smeared, dark}) {
    const Score score = Try(pebbles, 70, 30, photo);
    EXPECT_GE(score.whole_found, 0.9 * score.whole);
    EXPECT_EQ(score.wrong, 0);
    EXPECT_LT(Median(score.error_px), 0.06);
  }
}

TEST(DetectMarkers, CoveredRingsAreReadOrLeftButNeverMistaken) {
  const floor::Floor bare = floor::Floor::Build(Grid()).value();
  for (const double part : {0.12, 0.5}) {
    FloorOptions options = Grid();
    for (const floor::FloorMarker& marker : bare.markers()) {
      floor::Cover cover;  // a disc over the ring's edge, black, grey or white in turn
      const double angle = 0.7 * marker.id;
      cover.is_ellipse = true;
      cover.half_m = Eigen::Vector2d::Constant(marker.radius_m * (part < 0.3 ? 0.3 : 0.9));
      cover.center_m = marker.center_m.head<2>() +
                       1.1 * marker.radius_m * Eigen::Vector2d(cos(angle), sin(angle));
      cover.reflectance = 0.04 + 0.4 * (marker.id % 3);
      options.covers.push_back(cover);
    }
    FloorView view = TakeFloorView(options, 70, 25, {});
    for (MarkerTruth& truth : view.truths) truth.cover = 0;
    const Score score = ScoreOf(view, DetectMarkers(view.gray).value());
    EXPECT_EQ(score.wrong, 0);
    EXPECT_GE(score.whole_found, (part < 0.3 ? 0.75 : 0) * score.whole);
  }
}

TEST(DetectMarkers, IdsSeenTwiceAreDropped) {
  const FloorView view = TakeFloorView(Grid(6), 90, 0, {});
  cv::Mat twice;
  cv::hconcat(view.gray, view.gray(cv::Rect(0, 0, view.gray.cols * 3 / 5, view.gray.rows)), twice);
  const MarkerSearch once = DetectMarkers(view.gray).value();
  const MarkerSearch search = DetectMarkers(twice).value();
  ASSERT_EQ(once.markers.size(), 6u);
  EXPECT_TRUE(once.ambiguous.empty());
  EXPECT_FALSE(search.ambiguous.empty());
  EXPECT_EQ(search.markers.size() + search.ambiguous.size(), 6u);
  for (const MarkerDetection& marker : search.markers) {
    EXPECT_FALSE(std::binary_search(search.ambiguous.begin(), search.ambiguous.end(), marker.id));
  }
}

TEST(DetectMarkers, IdsThatWereNotPrintedAreNotFound) {
  const FloorView view = TakeFloorView(Grid(12), 90, 0, {});
  MarkerOptions options;
  options.id_count = 6;
  const MarkerSearch search = DetectMarkers(view.gray, options).value();
  EXPECT_EQ(search.markers.size(), 6u);
  EXPECT_EQ(search.markers.back().id, 5u);
}

TEST(DetectMarkers, AnyImageGetsAnAnswer) {
  SeededRandom random(2);
  for (const auto& [rows, cols] :
       {std::pair(0, 0), {1, 1}, {1, 3000}, {3000, 1}, {39, 500}, {40, 40}, {333, 777}}) {
    cv::Mat noise(rows, cols, CV_8UC1), flat(rows, cols, CV_8UC1, cv::Scalar(255));
    for (int v = 0; v < rows; ++v) {
      for (int u = 0; u < cols; ++u)
        noise.at<uint8_t>(v, u) = static_cast<uint8_t>(random.Below(256));
    }
    for (const cv::Mat& gray : {noise, flat}) {
      const auto search = DetectMarkers(gray);
      ASSERT_TRUE(search.ok());
      EXPECT_TRUE(search->markers.empty());
    }
  }
  EXPECT_EQ(DetectMarkers(cv::Mat(50, 50, CV_8UC3)).status().code(), StatusCode::kInvalidArgument);
  MarkerOptions options;
  options.code_budget = 7;
  EXPECT_EQ(DetectMarkers(cv::Mat(), options).status().code(), StatusCode::kInvalidArgument);
}

TEST(DetectMarkers, DamagedFilesNeverCrashAndNeverSayAnotherId) {
  const FloorView view = TakeFloorView(Grid(6), 60, 20, {}, testing::FloorCameraModel(320, 240));
  const std::vector<uint8_t> jpeg = testing::EncodeGrayJpeg(view.gray);
  SeededRandom random(HashContent(jpeg).Seed());
  DecodeLimits limits;
  limits.pixels_max = 1 << 20;
  int decoded = 0, found = 0;
  for (int i = 0; i < 300; ++i) {
    std::vector<uint8_t> bytes = jpeg;
    for (uint32_t k = 0; k <= random.Below(4); ++k) {
      bytes[random.Below(static_cast<uint32_t>(bytes.size()))] ^=
          static_cast<uint8_t>(1 + random.Below(255));
    }
    if (i % 8 == 0) bytes.resize(1 + random.Below(static_cast<uint32_t>(bytes.size())));
    const DecodedPhoto photo = DecodePhoto(bytes, limits);
    if (photo.gray.empty()) continue;
    ++decoded;
    const MarkerSearch search = DetectMarkers(photo.gray).value();
    for (const MarkerDetection& marker : search.markers) {
      EXPECT_LT(marker.id, 6u) << marker.error_count << " errors, " << marker.erasure_count
                               << " erasures";
      EXPECT_TRUE(marker.center_px.allFinite() && marker.covariance_px2.allFinite());
      ++found;
    }
  }
  EXPECT_GT(decoded, 50) << "files that the decoder refuses prove nothing of the detector";
  EXPECT_GT(found, 100);
}

}  // namespace
}  // namespace veduta
