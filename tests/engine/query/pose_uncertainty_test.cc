// SPDX-License-Identifier: Apache-2.0
// Goal: the door tells the covariance of exactly the observations that are stored, and damage in
//   them is an error that names it.
// Method: a street of a few photos; the problem of each image is gathered once more, from a scan of
//   all points; then records are written that contradict each other.
#include "engine/query/pose_uncertainty.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/mapping/bundle_adjustment.h"
#include "engine/mapping/pose_covariance.h"
#include "storage/model/pinhole.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

class PoseUncertaintyTest : public testing::Test {
 protected:
  void SetUp() override {
    city_.Add(Walk(6, 0.9, 5));
    names_ = {};
    ASSERT_OK(Snap()->ScanImages([&](const ImageRecord& image) {
      names_.push_back(image.name);
      ids_.push_back(image.id);
      return true;
    }));
  }

  std::shared_ptr<const Snapshot> Snap() const { return city_.parts().database->GetSnapshot(); }

  City city_;
  std::vector<std::string> names_;
  std::vector<ImageId> ids_;
};

// Adds what is seen of one point, image by image in the order of its track.
void AddPoint(const Snapshot& snapshot, const PointRecord& point, BundleProblem* problem,
              std::map<ImageId, uint32_t>* places) {
  problem->points.push_back(point.position);
  problem->first_observation.push_back(static_cast<uint32_t>(problem->observations.size()));
  for (const TrackElement& element : point.track) {
    const ImageRecord image = *snapshot.GetImage(element.image);
    const auto [place, is_new] = places->emplace(element.image, places->size());
    if (is_new) {
      problem->cams_from_world.push_back((*snapshot.FindPose(element.image))->cam_from_world);
      problem->cameras.emplace_back(snapshot.GetCamera(image.camera)->model);
    }
    const auto features = snapshot.GetFeatures(image.photo);
    const Keypoint& keypoint = features->keypoints[element.feature];
    problem->observations.push_back({place->second, {keypoint.x_px, keypoint.y_px}});
  }
}

// The problem of an image from all points of its reconstruction.
BundleProblem ProblemOf(const Snapshot& snapshot, ImageId image) {
  BundleProblem problem;
  const PoseRecord pose = **snapshot.FindPose(image);
  std::map<ImageId, uint32_t> places = {{image, 0}};
  problem.cams_from_world.push_back(pose.cam_from_world);
  problem.cameras.emplace_back(snapshot.GetCamera(snapshot.GetImage(image)->camera)->model);
  problem.free_count = 1;
  const auto record = snapshot.GetReconstruction(pose.reconstruction);
  EXPECT_OK(
      snapshot.ScanPointBlocks(record->id, record->points_generation, [&](const PointBlock& block) {
        for (const PointRecord& point : block.points) {
          const bool is_seen = std::ranges::any_of(
              point.track, [&](const TrackElement& e) { return e.image == image; });
          if (is_seen) AddPoint(snapshot, point, &problem, &places);
        }
        return true;
      }));
  problem.first_observation.push_back(static_cast<uint32_t>(problem.observations.size()));
  return problem;
}

TEST_F(PoseUncertaintyTest, IsTheCovarianceOfWhatIsStored) {
  const auto snapshot = Snap();
  uint32_t placed = 0;
  for (size_t i = 0; i < ids_.size(); ++i) {
    SCOPED_TRACE(names_[i]);
    const auto answer = city_.engine().Ask().Uncertainty(names_[i]);
    ASSERT_OK(answer);
    const bool has_pose = snapshot->FindPose(ids_[i])->has_value();
    ASSERT_EQ(answer->has_value(), has_pose);
    if (!has_pose) continue;
    ++placed;
    const BundleProblem problem = ProblemOf(*snapshot, ids_[i]);
    const auto expected = CovarianceOfPose(problem, BundleOptions());
    ASSERT_TRUE(expected);
    double angle_square = 0, distance_square = 0;
    for (size_t row = 0; row < 6; ++row) {
      for (size_t column = 0; column < 6; ++column) {
        const auto at = [&](size_t k) { return static_cast<Eigen::Index>(k); };
        EXPECT_NEAR((**answer).covariance[row][column], expected->covariance(at(row), at(column)),
                    1e-6 * std::sqrt(expected->covariance(at(row), at(row)) *
                                     expected->covariance(at(column), at(column))));
      }
      (row < 3 ? angle_square : distance_square) += (**answer).covariance[row][row];
    }
    EXPECT_NEAR((**answer).rotation_stddev_deg, std::sqrt(angle_square) * 180 / M_PI, 1e-12);
    EXPECT_NEAR((**answer).center_stddev, std::sqrt(distance_square), 1e-12);
    EXPECT_NEAR((**answer).error_px, expected->error_px, 1e-9);
    EXPECT_EQ((**answer).points, problem.points.size());
    EXPECT_EQ((**answer).points, snapshot->GetObservations(ids_[i])->size());
    EXPECT_EQ((**answer).images_held, problem.cams_from_world.size() - 1);
    // These photos are of 384 rows, features lie to a fraction of a pixel.
    EXPECT_GT((**answer).error_px, 0.02);
    EXPECT_LT((**answer).error_px, 1);
    EXPECT_LT((**answer).rotation_stddev_deg, 0.5);
  }
  EXPECT_GE(placed, 5u);
  EXPECT_EQ(city_.engine().Ask().Uncertainty("nobody.jpg").status().code(), StatusCode::kNotFound);
}

TEST_F(PoseUncertaintyTest, ContradictionsAreErrors) {
  const auto snapshot = Snap();
  const auto first =
      std::ranges::find_if(ids_, [&](ImageId id) { return snapshot->FindPose(id)->has_value(); });
  ASSERT_NE(first, ids_.end());
  const std::vector<Observation> observations = *snapshot->GetObservations(*first);
  ASSERT_FALSE(observations.empty());
  const auto write = [&](const std::function<void(Transaction*)>& put) {
    const auto transaction = city_.parts().database->BeginTransaction();
    put(transaction.get());
    EXPECT_OK(transaction->Commit());
  };
  const auto expect_damage = [&](const std::string& words) {
    UnsureCache unsure;
    const auto answer = UncertaintyOf(*Snap(), *first, &unsure);
    EXPECT_EQ(answer.status().code(), StatusCode::kCorruption);
    EXPECT_NE(answer.status().message().find(words), std::string::npos)
        << answer.status().message();
  };
  std::vector<Observation> strange = observations;
  strange.back().point.ordinal += 1'000'000;
  write([&](Transaction* t) { t->PutObservations(*first, strange); });
  expect_damage("a point that is not there");
  write([&](Transaction* t) { t->PutObservations(*first, observations); });
  UnsureCache unsure;
  EXPECT_OK(UncertaintyOf(*Snap(), *first, &unsure));

  const PoseRecord pose = **snapshot->FindPose(*first);
  const auto record = snapshot->GetReconstruction(pose.reconstruction);
  const ImageId home = observations.front().point.home;
  const PointBlock block = *snapshot->GetPointBlock(record->id, record->points_generation, home);
  PointBlock beyond = block;
  for (PointRecord& point : beyond.points) point.track.back().feature = 1'000'000;
  write([&](Transaction* t) { t->PutPointBlock(record->id, record->points_generation, beyond); });
  expect_damage("a feature that does not exist");
  write([&](Transaction* t) { t->PutPointBlock(record->id, record->points_generation, block); });

  // Another image of the tracks lies in another reconstruction.
  const auto other = std::ranges::find_if(block.points.front().track,
                                          [&](const TrackElement& e) { return e.image != *first; });
  ASSERT_NE(other, block.points.front().track.end());
  PoseRecord elsewhere = **snapshot->FindPose(other->image);
  elsewhere.reconstruction = ReconstructionId(99);
  write([&](Transaction* t) { t->PutPose(elsewhere); });
  expect_damage("in which it has no pose");
}

}  // namespace
}  // namespace veduta
