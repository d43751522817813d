// SPDX-License-Identifier: Apache-2.0
// Goal: each step from observations to a first scene does its part alone: the tree of views,
//   the distortion (equations 1 and 2), the focal length (3 and 4), the pose before a plane,
//   the metric scene, the inverse of the distortion.
// Method: sessions of known truth without noise, where each step must be exact, and with it,
//   where it must be near.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "engine/camera/calibration/distortion_estimation.h"
#include "engine/camera/calibration/distortion_inversion.h"
#include "engine/camera/calibration/focal_search.h"
#include "engine/camera/calibration/metric_initialization.h"
#include "engine/camera/calibration/planar_views.h"
#include "engine/camera/calibration/plane_pose.h"
#include "engine/camera/calibration/scene_initialization.h"
#include "engine/camera/calibration/view_tree.h"
#include "engine/camera/projection.h"
#include "tools/calibration/synthetic_session.h"

namespace veduta {
namespace {

// All exact: no noise, flat sheets, everything about the image's centre.
SessionOptions Exact(uint64_t seed, double distortion) {
  return {.focal_per_width = 1.1,
          .distortion_at_corner = distortion,
          .second_share = 0,
          .principal_offset = 0,
          .distortion_offset = 0,
          .photo_count = 10,
          .noise_px = 1e-9,
          .sheet_height_mm = 0,
          .seed = seed};
}

// From the root's to a view's undistorted image, by the true poses.
Eigen::Matrix3d TrueHomography(const SyntheticSession& session, const ImageUnits& units,
                               uint32_t root, uint32_t view) {
  const auto from_plane = [&](uint32_t v) {
    const Rigid3& pose = session.cams_from_world[v];
    Eigen::Matrix3d h;
    h << pose.rotation.toRotationMatrix().leftCols<2>(), pose.translation;
    const double f = session.truth.fx / units.unit_px;
    return Eigen::Matrix3d(Eigen::Vector3d(f, f, 1).asDiagonal() * h);
  };
  const Eigen::Matrix3d h = from_plane(view) * from_plane(root).inverse();
  return h / h.norm();
}

TEST(PlanarViews, NumberedDenselyAboutTheCenter) {
  CalibrationInput input;
  input.views.resize(2);
  for (ViewObservations& view : input.views) view.size = {201, 101};
  input.views[0].points = {{70, {100, 50}, 2}, {5, {0, 0}, 1}, {9, {1, 1}, 1}, {9, {2, 2}, 1}};
  input.views[1].points = {{9, {200, 100}, 1}, {70, {10, 10}, 1}};
  const PlanarViews planar = MakePlanarViews(input);
  EXPECT_EQ(planar.point_ids, (std::vector<uint32_t>{5, 9, 70}));
  ASSERT_EQ(planar.views[0].size(), 2u);  // 9 was seen twice
  EXPECT_EQ(planar.views[0][1].point, 2u);
  EXPECT_LT(planar.views[0][1].x.norm(), 1e-12);
  EXPECT_DOUBLE_EQ(planar.views[0][1].sigma, 2. / 201);
  EXPECT_LT((planar.units.ToPx(planar.views[1][0].x) - Eigen::Vector2d(200, 100)).norm(), 1e-9);
  EXPECT_EQ(CommonPoints(planar.views[0], planar.views[1]),
            (std::vector<std::pair<uint32_t, uint32_t>>{{1, 1}}));
}

TEST(ViewTree, ExactHomographiesOfAllViews) {
  const SyntheticSession session = MakeSession(Exact(1, 0));
  const PlanarViews planar = MakePlanarViews(session.input);
  const ViewTree tree = GrowViewTree(planar.views);
  ASSERT_EQ(tree.order.size(), 10u);
  EXPECT_EQ(tree.order.front(), tree.root);
  for (const uint32_t v : tree.order) {
    const Eigen::Matrix3d truth = TrueHomography(session, planar.units, tree.root, v),
                          h = tree.ViewFromRoot(v);
    EXPECT_LT((h - truth * (h.cwiseProduct(truth).sum() < 0 ? -1 : 1)).norm(), 1e-6) << v;
  }
}

TEST(ViewTree, ViewsWithoutCommonPointsStayOutside) {
  SyntheticSession session = MakeSession(Exact(2, 0));
  for (const size_t v : {2, 7}) {  // two of another floor
    for (PointObservation& p : session.input.views[v].points) p.id += 1000;
  }
  const PlanarViews planar = MakePlanarViews(session.input);
  const ViewTree tree = GrowViewTree(planar.views);
  EXPECT_EQ(tree.order.size(), 8u);
  EXPECT_FALSE(tree.Contains(2));
  EXPECT_FALSE(tree.Contains(7));
  EXPECT_TRUE(GrowViewTree({}).order.empty());
}

TEST(DistortionEstimation, InverseOfWhatTheLensDoes) {
  for (const double strength : {-0.1, -0.02, 0.03}) {
    SessionOptions options = Exact(3, strength);
    options.distortion_offset = 0.03;
    const SyntheticSession session = MakeSession(options);
    const PlanarViews planar = MakePlanarViews(session.input);
    ViewTree tree = GrowViewTree(planar.views);
    const auto estimate = EstimateDistortion(planar.views, {}, &tree);
    ASSERT_TRUE(estimate.ok()) << estimate.status().message();
    // The forward polynomial has no exact inverse of this form: what is left of it is a few px of
    // 50 to 200.
    double before = 0, after = 0;
    for (const ViewObservations& view : session.input.views) {
      for (const PointObservation& p : view.points) {
        const Eigen::Vector2d truth = *UndistortPixel(session.truth, p.px);
        const Eigen::Vector2d ours =
            planar.units.ToPx(estimate->distortion.Undistort(planar.units.FromPx(p.px)));
        before = std::max(before, (p.px - truth).norm());
        after = std::max(after, (ours - truth).norm());
      }
    }
    EXPECT_LT(after, 0.1 * before) << strength;
    EXPECT_LT((planar.units.ToPx(estimate->distortion.center) -
               Eigen::Vector2d(session.truth.u0, session.truth.v0))
                  .norm(),
              15)
        << strength;
    EXPECT_LT(estimate->residual_median * planar.units.unit_px, 0.5);
  }
}

TEST(DistortionEstimation, NoLensNoDistortion) {
  const SyntheticSession session = MakeSession(Exact(4, 0));
  const PlanarViews planar = MakePlanarViews(session.input);
  ViewTree tree = GrowViewTree(planar.views);
  const auto estimate = EstimateDistortion(planar.views, {}, &tree);
  ASSERT_TRUE(estimate.ok());
  EXPECT_LT(std::abs(estimate->distortion.k1), 1e-4);
  EXPECT_LT(std::abs(estimate->distortion.k2), 1e-3);
}

TEST(DistortionInversion, ThereAndBackAgain) {
  const ImageUnits units(ImageSize{1600, 1200});
  CameraModel pinhole{1600, 1200, 1500, 1500, 799.5, 599.5};
  for (const double k1 : {-0.15, 0.0, 0.2, 0.4}) {
    const InverseDistortion inverse{{0.01, -0.02}, k1, 0.1 * k1};
    ConversionResidual residual;
    const CameraModel model = InvertDistortion(inverse, units, pinhole, &residual);
    EXPECT_LT(residual.largest_px, 0.02 * std::abs(k1) * 1600 + 1e-6) << k1;
    EXPECT_LE(residual.mean_px, residual.largest_px);
    EXPECT_LT((Eigen::Vector2d(model.u0, model.v0) - units.ToPx(inverse.center)).norm(), 1e-9);
    EXPECT_EQ(model.k1 > 0, k1 < 0);  // the inverse bends the other way
    const Eigen::Vector2d px(300, 250);
    EXPECT_LT((*UndistortPixel(model, px) - units.ToPx(inverse.Undistort(units.FromPx(px)))).norm(),
              2 * residual.largest_px + 1e-6);
  }
}

TEST(FocalSearch, FindsTheFocalLengthAndTheNormal) {
  for (const double focal : {0.5, 1.0, 2.2}) {
    SessionOptions options = Exact(5, 0);
    options.focal_per_width = focal;
    const SyntheticSession session = MakeSession(options);
    const ImageUnits units(options.size);
    std::vector<std::vector<Eigen::Matrix3d>> homographies(1);
    for (uint32_t v = 1; v < 10; ++v)
      homographies[0].push_back(TrueHomography(session, units, 0, v));
    const auto found = SearchFocalLength(homographies);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->focal / focal, 1, 0.002);
    EXPECT_LT(found->disagreement_deg, 0.1);
    const Eigen::Vector3d up = session.cams_from_world[0].rotation * Eigen::Vector3d::UnitZ();
    EXPECT_GT(-AgreedNormal(homographies[0], focal).dot(up), 0.99999);
  }
  EXPECT_FALSE(SearchFocalLength({}));
}

TEST(FocalSearch, WithinFivePercentOfNoisySessions) {
  for (uint32_t i = 0; i < 12; ++i) {
    const SyntheticSession session = MakeSession(ExperimentOptions(100 + i));
    const auto scene = InitializeScene(MakePlanarViews(session.input), session.input.views[0].size);
    ASSERT_TRUE(scene.ok()) << scene.status().message();
    EXPECT_NEAR(scene->focal_px / session.truth.fx, 1, 0.05) << i;
  }
}

TEST(PlanePose, ExactAndWithoutTheWrongOnes) {
  const Rigid3 truth{
      Eigen::Quaterniond(Eigen::AngleAxisd(2.5, Eigen::Vector3d(1, 0.2, 0.1).normalized())),
      {0.1, -0.2, 3}};
  std::vector<Eigen::Vector2d> plane, seen;
  for (int i = 0; i < 30; ++i) {
    plane.emplace_back(i % 6 * 0.2 - 0.5, i / 6 * 0.25 - 0.5);
    seen.push_back((truth * Eigen::Vector3d(plane.back().x(), plane.back().y(), 0)).hnormalized());
  }
  seen[3] = {0.3, 0.3};
  seen[17] = {-0.2, 0.1};
  const auto pose = EstimatePlanePose(plane, seen, 1e-3, 1);
  ASSERT_TRUE(pose);
  EXPECT_EQ(pose->inliers.size(), 28u);
  EXPECT_LT(pose->cam_from_world.rotation.angularDistance(truth.rotation), 1e-6);
  EXPECT_LT((pose->cam_from_world.translation - truth.translation).norm(), 1e-6);
  EXPECT_FALSE(EstimatePlanePose({plane.data(), 5}, {seen.data(), 5}, 1e-3, 1));
}

TEST(MetricInitialization, TheSceneUpToASimilarity) {
  const SyntheticSession session = MakeSession(Exact(6, 0));
  const PlanarViews planar = MakePlanarViews(session.input);
  const ViewTree tree = GrowViewTree(planar.views);
  const MetricReconstruction made =
      InitializeMetric(planar.views, tree, session.truth.fx / planar.units.unit_px);
  const Rigid3& root_truth = session.cams_from_world[tree.root];
  const double scale = root_truth.Center().z();  // the root's distance from the plane is 1
  for (size_t v = 0; v < 10; ++v) {
    ASSERT_TRUE(made.cams_from_world[v]) << v;
    const Rigid3 root_from_view =
        *made.cams_from_world[tree.root] * made.cams_from_world[v]->Inverse();
    const Rigid3 truth = root_truth * session.cams_from_world[v].Inverse();
    EXPECT_LT(root_from_view.rotation.angularDistance(truth.rotation), 1e-5) << v;
    EXPECT_LT((scale * root_from_view.translation - truth.translation).norm(), 1e-4) << v;
    EXPECT_GT(made.cams_from_world[v]->Center().z(), 0);
  }
  for (size_t p = 0; p < made.points.size(); ++p) {
    ASSERT_TRUE(made.points[p]);
    const Eigen::Vector3d in_root = *made.cams_from_world[tree.root] *
                                    Eigen::Vector3d(made.points[p]->x(), made.points[p]->y(), 0);
    EXPECT_LT((scale * in_root - root_truth * session.points[planar.point_ids[p]]).norm(), 1e-4);
  }
}

TEST(MetricInitialization, AMovedPointLiesWhereMostSawIt) {
  EXPECT_LT((*Consensus({{0, 0}, {5, 5}, {0.1, 0}, {0, 0.1}, {5.1, 5}}, 0.5) -
             Eigen::Vector2d(0.1 / 3, 0.1 / 3))
                .norm(),
            1e-12);
  EXPECT_FALSE(Consensus({}, 1));
}

TEST(SceneInitialization, TooFewViewsSayWhatToDo) {
  SyntheticSession session = MakeSession(Exact(7, 0));
  session.input.views.resize(2);
  const auto scene = InitializeScene(MakePlanarViews(session.input), {2272, 1704});
  ASSERT_FALSE(scene.ok());
  EXPECT_NE(scene.status().message().find("take more photos"), std::string::npos);
}

}  // namespace
}  // namespace veduta
