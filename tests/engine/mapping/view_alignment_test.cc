// SPDX-License-Identifier: Apache-2.0
// Goal: what cameras of one side see of the other's points gives the similarity of the two, with
//   its scale, also among wrong matches; nothing where the scale stays open or too little agrees.
// Method: a synthetic scene in two frames, whose cameras see points of the other frame only; every
//   fifth sighting is of another point.
#include "engine/mapping/view_alignment.h"

#include <gtest/gtest.h>

#include "synthetic_scene.h"
#include "tests/option_bounds.h"

namespace veduta {
namespace {

const Sim3 kBFromA{
    2.5,
    Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized())),
    {1, -2, 3}};

class ViewAlignmentTest : public testing::Test {
 protected:
  ViewAlignmentTest() : scene_(MakeScene({})) {}

  // What one of the scene's cameras sees of some of its points; the frame of either is `cameras`
  // and `points`, from that of the scene.
  std::vector<CrossSighting> See(uint32_t camera, size_t first, size_t count, const Sim3& cameras,
                                 const Sim3& points) const {
    std::vector<CrossSighting> seen;
    for (size_t i = first; i < first + count; ++i) {
      const Eigen::Vector3d x_cam = scene_.poses[camera] * scene_.points[i];
      const Eigen::Vector3d& known = scene_.points[i % 5 ? i : i + 70];
      seen.push_back({ImageId(camera + 1), TransformCameraWorld(cameras, scene_.poses[camera]),
                      x_cam.hnormalized(), points * known});
    }
    return seen;
  }
  std::vector<CrossSighting> InB(uint32_t camera, size_t first, size_t count) const {
    return See(camera, first, count, kBFromA, {});
  }
  std::vector<CrossSighting> InA(uint32_t camera, size_t first, size_t count) const {
    return See(camera, first, count, {}, kBFromA);
  }

  static void ExpectRight(const std::optional<ViewAlignment>& found) {
    ASSERT_TRUE(found.has_value());
    EXPECT_NEAR(found->b_from_a.scale, kBFromA.scale, 1e-3);
    EXPECT_LT(found->b_from_a.rotation.angularDistance(kBFromA.rotation), 1e-3);
    EXPECT_LT((found->b_from_a.translation - kBFromA.translation).norm(), 5e-3);
  }

  const SyntheticScene scene_;
};

TEST_F(ViewAlignmentTest, OneCameraOfEitherSideGivesTheScale) {
  const auto in_b = InB(1, 0, 60), in_a = InA(2, 60, 60);
  const auto found = AlignByViews(in_b, in_a, 7, {});
  ExpectRight(found);
  EXPECT_GE(found->agreeing, 96u);
  EXPECT_LE(found->agreeing, 100u);
  // The same whichever is named first, and each time.
  const auto back = AlignByViews(in_a, in_b, 7, {});
  ASSERT_TRUE(back.has_value());
  EXPECT_NEAR(back->b_from_a.scale, 1 / kBFromA.scale, 1e-3);
  EXPECT_EQ(AlignByViews(in_b, in_a, 7, {})->b_from_a.translation, found->b_from_a.translation);
}

TEST_F(ViewAlignmentTest, TwoCamerasOfOneSideGiveIt) {
  auto in_b = InB(1, 0, 60);
  const auto more = InB(3, 0, 60);
  in_b.insert(in_b.end(), more.begin(), more.end());
  ExpectRight(AlignByViews(in_b, {}, 7, {}));
  ExpectRight(AlignByViews(InB(1, 0, 60), InA(3, 0, 40), 8, {}));
}

TEST_F(ViewAlignmentTest, OneCameraLeavesTheScaleOpen) {
  EXPECT_FALSE(AlignByViews(InB(1, 0, 100), {}, 7, {}).has_value());
  EXPECT_FALSE(AlignByViews({}, {}, 7, {}).has_value());
  // Two sightings of another camera are a guess.
  auto in_b = InB(1, 0, 100);
  const auto few = InB(3, 1, 2);
  in_b.insert(in_b.end(), few.begin(), few.end());
  EXPECT_FALSE(AlignByViews(in_b, {}, 7, {}).has_value());
}

TEST_F(ViewAlignmentTest, CamerasThatContradictGiveNothing) {
  // Each side's camera is placed well, but the other's points lie elsewhere.
  const Sim3 elsewhere{
      1, Eigen::Quaterniond(Eigen::AngleAxisd(1, Eigen::Vector3d::UnitY())), {9, 9, 9}};
  EXPECT_FALSE(
      AlignByViews(InB(1, 0, 60), See(2, 60, 60, {}, elsewhere * kBFromA), 7, {}).has_value());
}

TEST_F(ViewAlignmentTest, AScaleThatErrorsHideIsNotBelieved) {
  EXPECT_FALSE(AlignByViews(InB(1, 0, 60), InA(2, 60, 60), 7, {.log_scale_deviation_max = 1e-9})
                   .has_value());
}

TEST(ViewAlignmentOptions, RefusesWhatIsOutOfBounds) {
  using O = ViewAlignmentOptions;
  ExpectBounds(&O::cameras_max, "cameras_max", {0u}, {1u, 10u});
  ExpectBounds(&O::error_px_max, "error_px_max", {0.0, -1.0}, {0.1, 10.0});
  ExpectBounds(&O::other_sightings_min, "other_sightings_min", {0u}, {1u, 100u});
  ExpectBounds(&O::log_scale_deviation_max, "log_scale_deviation_max", {0.0, -1.0}, {0.001, 1.0});
}

}  // namespace
}  // namespace veduta
