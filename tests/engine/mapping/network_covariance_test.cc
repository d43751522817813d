// SPDX-License-Identifier: Apache-2.0
// Goal: the covariance of a pose among uncertain neighbours says how far it is from the truth in
//   their common frame, whatever that frame is, also where errors side by side are alike; it says
//   nothing where nothing is known.
// Method: networks adjusted to many draws of noise, aligned with the truth by the other cameras;
//   the same network moved, turned and scaled; networks that lack what is needed.
#include "engine/mapping/network_covariance.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "engine/mapping/bundle_adjustment.h"
#include "storage/base/content_hash.h"
#include "synthetic_scene.h"

namespace veduta {
namespace {

// All cameras at the truth with the points that two of them see. `shared_px`: what features of one
// cell of a picture are off together.
CityMap MapOf(SyntheticScene* scene, double shared_px, uint64_t seed) {
  CityMap map;
  for (size_t k = 0; k < scene->images.size(); ++k) {
    MapImage image = scene->images[k];
    auto features = std::make_shared<Features>(*image.features);
    for (Keypoint& keypoint : features->keypoints) {
      const auto cell = static_cast<uint64_t>(keypoint.x_px / 250) * 10 +
                        static_cast<uint64_t>(keypoint.y_px / 250);
      SeededRandom random(MixSeed(seed, 100 * k + cell));
      keypoint.x_px += static_cast<float>(shared_px * (2 * random.Unit() - 1));
      keypoint.y_px += static_cast<float>(shared_px * (2 * random.Unit() - 1));
    }
    image.features = features;
    image.reconstruction = ReconstructionId(1);
    image.cam_from_world = scene->poses[k];
    map.PlaceImage(std::move(image));
  }
  for (size_t i = 0; i < scene->points.size(); ++i) {
    std::vector<TrackElement> track;
    for (size_t k = 0; k < scene->images.size(); ++k) {
      if (scene->feature_of[k][i] >= 0)
        track.push_back({scene->images[k].id, static_cast<FeatureIndex>(scene->feature_of[k][i])});
    }
    if (track.size() >= 2) map.AddPoint(track.front().image, scene->points[i], track);
  }
  return map;
}

std::vector<ImageId> IdsOf(const SyntheticScene& scene) {
  std::vector<ImageId> ids;
  for (const MapImage& image : scene.images) ids.push_back(image.id);
  return ids;
}

// d' C^-1 d of the last camera's centre, in the frame that fits the others best.
double CenterSquares(const CityMap& map, const SyntheticScene& scene, const Matrix6d& covariance) {
  const Eigen::Index others = static_cast<Eigen::Index>(scene.poses.size()) - 1;
  Eigen::Matrix3Xd found(3, 2 * others), truth(3, 2 * others);
  for (Eigen::Index k = 0; k < others; ++k) {
    const Rigid3& pose = map.image(scene.images[static_cast<size_t>(k)].id).cam_from_world;
    const Rigid3& real = scene.poses[static_cast<size_t>(k)];
    found.col(k) = pose.Center();
    truth.col(k) = real.Center();
    found.col(others + k) = pose.Inverse() * Eigen::Vector3d(0, 0, 8);  // as far as the points
    truth.col(others + k) = real.Inverse() * Eigen::Vector3d(0, 0, 8);
  }
  const Eigen::Matrix4d found_from_truth = Eigen::umeyama(truth, found);
  const Eigen::Vector3d real =
      (found_from_truth * scene.poses.back().Center().homogeneous()).head<3>();
  const Eigen::Vector3d off = real - map.image(scene.images.back().id).cam_from_world.Center();
  return off.dot(covariance.bottomRightCorner<3, 3>().ldlt().solve(off));
}

// Of 40 draws, those whose true centre is in the ellipsoid of 95 %.
uint32_t CountInside(double noise_px, double shared_px) {
  uint32_t inside = 0;
  for (uint64_t seed = 1; seed <= 40; ++seed) {
    SyntheticScene scene =
        MakeScene({.camera_count = 8, .point_count = 400, .noise_px = noise_px, .seed = seed});
    CityMap map = MapOf(&scene, shared_px, seed);
    const std::vector<ImageId> ids = IdsOf(scene);
    BundleOptions options;
    options.function_tolerance = 1e-9;
    EXPECT_TRUE(AdjustBundle(&map, ids, map.PointsSeenBy(ids), options, nullptr).ok());
    const auto found =
        CovarianceInNetwork(NetworkProblem(map, ids.back(), 20), options.loss_scale_px);
    EXPECT_TRUE(found);
    if (found && CenterSquares(map, scene, found->covariance) <= 7.8147) ++inside;
  }
  return inside;
}

TEST(NetworkCovariance, TheTruthIsInTheEllipsoid) {
  EXPECT_GE(CountInside(0.4, 0), 33u);
}

TEST(NetworkCovariance, TheTruthIsInTheEllipsoidWhereErrorsSideBySideAreAlike) {
  EXPECT_GE(CountInside(0.2, 0.8), 33u);
}

TEST(NetworkCovariance, IsTheSameInAnyFrame) {
  SyntheticScene scene = MakeScene({.camera_count = 6, .point_count = 200});
  const CityMap map = MapOf(&scene, 0, 1);
  const BundleProblem problem = NetworkProblem(map, scene.images[2].id, 20);
  EXPECT_EQ(problem.cams_from_world.size(), 6u);
  EXPECT_EQ(problem.free_count, 6u);
  const Sim3 moved_from_world{
      2.5,
      Eigen::Quaterniond(Eigen::AngleAxisd(0.9, Eigen::Vector3d(1, -2, 1).normalized())),
      {30, -20, 10}};
  BundleProblem moved = problem;
  for (Rigid3& pose : moved.cams_from_world) pose = TransformCameraWorld(moved_from_world, pose);
  for (Eigen::Vector3d& point : moved.points) point = moved_from_world * point;
  const auto one = CovarianceInNetwork(problem, 1), other = CovarianceInNetwork(moved, 1);
  ASSERT_TRUE(one && other);
  Matrix6d turn = Matrix6d::Identity();  // omega is in the camera's frame, and stays
  turn.bottomRightCorner<3, 3>() = 2.5 * moved_from_world.rotation.toRotationMatrix();
  const Matrix6d expected = turn * one->covariance * turn.transpose();
  EXPECT_LT((other->covariance - expected).norm(), 1e-5 * expected.norm());
  EXPECT_NEAR(other->error_px, one->error_px, 1e-9);
}

TEST(NetworkCovariance, SaysNothingWhereNothingIsKnown) {
  SyntheticScene scene = MakeScene({.camera_count = 4, .point_count = 200});
  const CityMap map = MapOf(&scene, 0, 1);
  EXPECT_TRUE(CovarianceInNetwork(NetworkProblem(map, scene.images[0].id, 2), 1));
  EXPECT_FALSE(CovarianceInNetwork(NetworkProblem(map, scene.images[0].id, 1), 1))
      << "two cameras have no frame but their own";
  BundleProblem few = NetworkProblem(map, scene.images[0].id, 3);
  few.points.resize(3);
  few.first_observation.resize(4);
  EXPECT_FALSE(CovarianceInNetwork(few, 1));
  EXPECT_FALSE(CovarianceInNetwork({}, 1));
}

}  // namespace
}  // namespace veduta
