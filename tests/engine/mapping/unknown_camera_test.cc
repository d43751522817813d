// SPDX-License-Identifier: Apache-2.0
// Goal: a photo of an unknown camera gets its pose, focal length and distortion from points with
//   wrong ones among them; how sure they are is told; what determines nothing is told, too.
// Method: points before a camera of known truth, with noise and outliers; boxes, and planes that
//   are seen head on.
#include "engine/mapping/unknown_camera.h"

#include <gtest/gtest.h>

#include "engine/camera/projection.h"
#include "synthetic_scene.h"

namespace veduta {
namespace {

constexpr uint32_t kWidth = 1200, kHeight = 900;

struct Photo {
  CameraModel camera;
  Rigid3 pose;
  std::vector<Eigen::Vector2d> x_px;
  std::vector<Eigen::Vector3d> points;
  size_t right_count = 0;
};

// Points are seen with noise of 0.4 px; behind them come so many that are seen anywhere.
Photo TakePhoto(double focal_px, double k1, size_t wrong_count, bool is_plane, uint64_t seed) {
  Photo photo;
  photo.camera.width_px = kWidth, photo.camera.height_px = kHeight;
  photo.camera.fx = photo.camera.fy = focal_px;
  photo.camera.cx = photo.camera.u0 = 0.5 * (kWidth - 1);
  photo.camera.cy = photo.camera.v0 = 0.5 * (kHeight - 1);
  photo.camera.k1 = k1;
  photo.pose.rotation = Eigen::Quaterniond(
      Eigen::AngleAxisd(is_plane ? 0 : 0.4, Eigen::Vector3d(0.2, 1, 0.1).normalized()));
  photo.pose.translation = {0.5, -0.2, 1};
  SeededRandom random(seed);
  const auto within = [&](double size) { return size * (random.Unit() - 0.5); };
  while (photo.points.size() < 300) {
    // In the camera's frame, over the whole picture.
    const double depth = is_plane ? 10 : 6 + 10 * random.Unit();
    const Eigen::Vector2d straight(photo.camera.cx + within(1.2 * kWidth),
                                   photo.camera.cy + within(1.2 * kHeight));
    const Eigen::Vector2d x = DistortPixel(photo.camera, straight);
    if (x.x() < 0 || x.y() < 0 || x.x() > kWidth - 1 || x.y() > kHeight - 1) continue;
    const Eigen::Vector2d u = NormalizedFromPixel(photo.camera, straight);
    photo.points.push_back(photo.pose.Inverse() * Eigen::Vector3d(depth * u.homogeneous()));
    photo.x_px.push_back(x + 0.4 * Eigen::Vector2d{Gaussian(random), Gaussian(random)});
  }
  photo.right_count = photo.points.size();
  for (size_t i = 0; i < wrong_count; ++i) {
    photo.points.push_back(photo.points[i % photo.right_count]);
    photo.x_px.push_back({kWidth * random.Unit(), kHeight * random.Unit()});
  }
  return photo;
}

UnknownCameraResection Seek(const Photo& photo) {
  return ResectUnknownCamera(photo.x_px, photo.points, kWidth, kHeight, 1, {});
}

TEST(UnknownCamera, IsFoundWithThePose) {
  for (const double focal_px : {500.0, 1000.0, 3000.0}) {
    for (const double k1 : {-0.15, 0.0, 0.1}) {
      if (focal_px == 500 && k1 == -0.15) continue;  // it would fold over within the photo
      const Photo photo = TakePhoto(focal_px, k1, 300, false, 7);
      ASSERT_TRUE(CheckCamera(photo.camera).ok());
      const UnknownCameraResection found = Seek(photo);
      ASSERT_EQ(found.outcome, ResectionOutcome::kPlaced) << focal_px << " " << k1;
      EXPECT_NEAR(found.camera.fx / focal_px, 1, 0.01) << focal_px << " " << k1;
      EXPECT_LT((found.cam_from_world.Center() - photo.pose.Center()).norm(), 0.1);
      EXPECT_LT(RotationErrorDeg(found.cam_from_world, photo.pose), 0.3);
      EXPECT_GE(found.inliers.size(), 295u);
      EXPECT_LE(found.inliers.size(), 310u);
    }
  }
}

TEST(UnknownCamera, IsNotFoundInNoise) {
  Photo photo = TakePhoto(1000, 0, 300, false, 7);
  photo.x_px.erase(photo.x_px.begin(), photo.x_px.begin() + 300);
  photo.points.erase(photo.points.begin(), photo.points.begin() + 300);
  EXPECT_EQ(Seek(photo).outcome, ResectionOutcome::kTooFewInliers);
  photo.x_px.resize(29);
  photo.points.resize(29);
  EXPECT_EQ(Seek(photo).outcome, ResectionOutcome::kTooFewMatches);
}

// What a photo tells helps where few of the points are right, and a lie does no harm.
TEST(UnknownCamera, AToldFocalLengthIsTriedFirst) {
  const Photo photo = TakePhoto(1000, -0.05, 0, false, 7);
  Photo few = photo;
  few.x_px.resize(30), few.points.resize(30);
  SeededRandom random(11);
  for (size_t i = 0; i < 600; ++i) {
    few.points.push_back(photo.points[i % 300]);
    few.x_px.push_back({kWidth * random.Unit(), kHeight * random.Unit()});
  }
  UnknownCameraOptions told;
  told.told_focal_share = 1.05 * 1000 / kWidth;
  const auto seek = [](const Photo& seen, const UnknownCameraOptions& options) {
    return ResectUnknownCamera(seen.x_px, seen.points, kWidth, kHeight, 1, options);
  };
  EXPECT_EQ(seek(few, {}).outcome, ResectionOutcome::kTooFewInliers);
  const UnknownCameraResection found = seek(few, told);
  ASSERT_EQ(found.outcome, ResectionOutcome::kPlaced);
  EXPECT_NEAR(found.camera.fx / 1000, 1, 0.02);
  UnknownCameraOptions lie;
  lie.told_focal_share = 3;
  const UnknownCameraResection in_spite = seek(photo, lie), without = seek(photo, {});
  ASSERT_EQ(in_spite.outcome, ResectionOutcome::kPlaced);
  EXPECT_NEAR(in_spite.camera.fx / without.camera.fx, 1, 1e-6);
  EXPECT_EQ(in_spite.inliers, without.inliers);
}

TEST(UnknownCamera, AnswersTheSameTwice) {
  const Photo photo = TakePhoto(1000, -0.1, 300, false, 3);
  const UnknownCameraResection one = Seek(photo), two = Seek(photo);
  EXPECT_EQ(one.camera, two.camera);
  EXPECT_EQ(one.inliers, two.inliers);
}

// By 1.96 standard deviations 95 % of the true focal lengths are covered; of 40 draws 33 and more.
TEST(UnknownCamera, TellsHowSureTheFocalLengthIs) {
  uint32_t inside = 0;
  for (uint64_t seed = 1; seed <= 40; ++seed) {
    const Photo photo = TakePhoto(1000, -0.1, 0, false, seed);
    const RefinedCamera refined =
        RefineUnknownCamera(photo.pose, photo.camera, photo.x_px, photo.points, 2);
    const double off = std::log(refined.camera.fx / photo.camera.fx);
    inside += std::abs(off) <= 1.96 * refined.FocalDeviationShare() ? 1 : 0;
    EXPECT_LT(refined.FocalDeviationShare(), 0.005);
  }
  EXPECT_GE(inside, 33u);
}

// It decides where the photo itself leaves the focal length open, and has no say where it does not.
TEST(UnknownCamera, AToldFocalLengthHasASay) {
  const auto refine = [](const Photo& photo, double told_focal_px) {
    return RefineUnknownCamera(photo.pose, photo.camera, photo.x_px, photo.points, 2,
                               told_focal_px);
  };
  const Photo wall = TakePhoto(1000, 0, 0, true, 5), box = TakePhoto(1000, 0, 0, false, 5);
  EXPECT_NEAR(refine(wall, 1100).camera.fx / 1100, 1, 0.03);
  EXPECT_LT(refine(wall, 1100).FocalDeviationShare(), 0.05);
  EXPECT_NEAR(refine(box, 1100).camera.fx / refine(box, 0).camera.fx, 1, 0.001);
}

// Whoever sees a wall head on cannot tell a long lens from a short distance.
TEST(UnknownCamera, OfAWallSeenHeadOnStaysOpen) {
  const Photo photo = TakePhoto(1000, 0, 0, true, 5);
  const RefinedCamera refined =
      RefineUnknownCamera(photo.pose, photo.camera, photo.x_px, photo.points, 2);
  EXPECT_GT(refined.FocalDeviationShare(), 0.05);
}

TEST(UnknownCamera, ChecksItsOptions) {
  UnknownCameraOptions options;
  EXPECT_TRUE(options.Check().ok());
  options.focal_share_max = options.focal_share_min;
  EXPECT_FALSE(options.Check().ok());
}

}  // namespace
}  // namespace veduta
