// SPDX-License-Identifier: Apache-2.0
// Goal: the adjustment finds the camera from a poor start, its standard deviations are those
//   that repeated experiments show, and what observations and photos to use is chosen as said.
// Method: sessions of known truth; derivatives against differences; many noises on one session.
#include "engine/camera/calibration/plane_adjustment.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/camera/calibration/observation_choice.h"
#include "engine/camera/calibration/plane_reprojection_cost.h"
#include "engine/camera/calibration/readmission.h"
#include "engine/camera/calibration/view_focal.h"
#include "engine/camera/projection.h"
#include "storage/base/content_hash.h"
#include "tools/bench/calibration/synthetic_session.h"

namespace veduta {
namespace {

PlaneScene SceneOf(const SyntheticSession& session) {
  return {{session.truth}, {}, session.cams_from_world, session.points};
}

std::vector<PlaneObservation> ObservationsOf(const SyntheticSession& session) {
  std::vector<PlaneObservation> observations;
  for (uint32_t v = 0; v < session.input.views.size(); ++v) {
    for (const PointObservation& p : session.input.views[v].points) {
      observations.push_back({v, p.id, p.px, p.sigma_px});
    }
  }
  return observations;
}

TEST(PlaneReprojectionCost, ProjectsAsTheCameraModelDoes) {
  const SyntheticSession session = MakeSession({.seed = 1});
  const CameraModel& c = session.truth;
  const std::array<double, kLensSize> lens = {c.fx, c.fy / c.fx, c.cx, c.cy,
                                              c.k1, c.k2,        c.u0, c.v0};
  for (const PlaneObservation& o : ObservationsOf(session)) {
    const Rigid3& pose = session.cams_from_world[o.view];
    Eigen::Vector2d px;
    ASSERT_TRUE(PlaneReprojectionCost::Project(lens.data(), pose.rotation.coeffs().data(),
                                               pose.translation.data(),
                                               session.points[o.point].data(), px.data()));
    const Eigen::Vector2d expected =
        DistortPixel(c, *PixelFromBearing(c, pose * session.points[o.point]));
    EXPECT_LT((px - expected).norm(), 1e-8);
  }
  const Eigen::Vector3d behind = session.cams_from_world[0].Inverse() * Eigen::Vector3d(0, 0, -1);
  Eigen::Vector2d px;
  EXPECT_FALSE(PlaneReprojectionCost::Project(
      lens.data(), session.cams_from_world[0].rotation.coeffs().data(),
      session.cams_from_world[0].translation.data(), behind.data(), px.data()));
}

// Points in a box before cameras on an arc, near and far.
PlaneScene SolidScene() {
  PlaneScene scene;
  scene.camera().width_px = 1000, scene.camera().height_px = 750;
  scene.camera().fx = scene.camera().fy = 820;
  scene.camera().cx = 503, scene.camera().cy = 371;
  scene.camera().u0 = 503, scene.camera().v0 = 371;
  scene.camera().k1 = -0.05, scene.camera().k2 = 0.02;
  SeededRandom random(5);
  for (int i = 0; i < 250; ++i) {
    scene.points.push_back({4 * random.Unit() - 2, 3 * random.Unit() - 1.5, 4 * random.Unit() - 2});
  }
  for (int v = 0; v < 9; ++v) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.15 * (v - 4), Eigen::Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(v % 3 * 1.5, Eigen::Vector3d::UnitZ()));
    scene.cams_from_world.push_back({turn, Eigen::Vector3d(0, 0, 5 + 0.5 * (v % 4))});
  }
  return scene;
}

std::vector<PlaneObservation> WithNoise(const PlaneScene& truth) {
  SeededRandom random(6);
  std::vector<PlaneObservation> observations;
  for (uint32_t v = 0; v < truth.cams_from_world.size(); ++v) {
    const CameraModel& camera = truth.cameras[truth.CameraOf(v)];
    for (uint32_t p = 0; p < truth.points.size(); ++p) {
      const auto px = PixelFromBearing(camera, truth.cams_from_world[v] * truth.points[p]);
      EXPECT_TRUE(px.has_value());
      const Eigen::Vector2d noise{random.Unit() - 0.5, random.Unit() - 0.5};
      if (px) observations.push_back({v, p, DistortPixel(camera, *px) + 0.5 * noise, 1});
    }
  }
  return observations;
}

TEST(PlaneAdjustment, WithoutAPlaneFromAPoorStart) {
  const PlaneScene truth = SolidScene();
  const std::vector<PlaneObservation> observations = WithNoise(truth);
  PlaneScene scene = truth;
  scene.camera().fx = scene.camera().fy = 1.08 * truth.camera().fx;
  scene.camera().cx = scene.camera().u0 = 499.5;
  scene.camera().cy = scene.camera().v0 = 374.5;
  scene.camera().k1 = scene.camera().k2 = 0;
  PlaneAdjustmentOptions options;
  options.is_planar = false;
  options.principal_point_sigma = 0.007;
  options.distortion_center_sigma = 0.007;
  const auto made = AdjustPlane(observations, options, &scene);
  ASSERT_TRUE(made.ok()) << made.status().message();
  ASSERT_TRUE(made->is_determined);
  const std::array<double, 8> found = IntrinsicsOf(scene.camera()),
                              right = IntrinsicsOf(truth.camera());
  for (size_t i = 0; i < found.size(); ++i) {
    const double sigma =
        std::sqrt(made->covariance()(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(i)));
    EXPECT_GT(sigma, 0) << kIntrinsicNames[i];
    EXPECT_LT(std::abs(found[i] - right[i]), 4 * sigma) << kIntrinsicNames[i];
  }
  EXPECT_NEAR(scene.camera().fx, truth.camera().fx, 1);
  // The gauge: the first view stays, and so does the scale.
  EXPECT_EQ(scene.cams_from_world[0].translation, truth.cams_from_world[0].translation);
  for (size_t p = 0; p < truth.points.size(); ++p)
    EXPECT_LT((scene.points[p] - truth.points[p]).norm(), 0.05);
}

TEST(PlaneAdjustment, EachOfTwoCamerasHasItsOwnLens) {
  PlaneScene truth = SolidScene();
  truth.cameras.push_back(truth.camera());
  CameraModel& second = truth.cameras.back();
  second.width_px = 640, second.height_px = 480;
  second.fx = second.fy = 610;
  second.cx = second.u0 = 322, second.cy = second.v0 = 238;
  second.k1 = 0.04, second.k2 = -0.01;
  truth.camera_of_view = {0, 1, 1, 0, 1, 0, 0, 1, 0};
  PlaneScene scene = truth;
  for (CameraModel& camera : scene.cameras) {
    camera.fx = camera.fy = 1.05 * camera.fx;
    camera.k1 = camera.k2 = 0;
  }
  PlaneAdjustmentOptions options;
  options.is_planar = false;
  options.principal_point_sigma = 0.007;
  options.distortion_center_sigma = 0.007;
  const auto made = AdjustPlane(WithNoise(truth), options, &scene);
  ASSERT_TRUE(made.ok()) << made.status().message();
  ASSERT_TRUE(made->is_determined);
  ASSERT_EQ(made->covariances.size(), 2u);
  for (size_t camera = 0; camera < 2; ++camera) {
    const auto found = IntrinsicsOf(scene.cameras[camera]),
               right = IntrinsicsOf(truth.cameras[camera]);
    for (Eigen::Index i = 0; i < 8; ++i) {
      const double sigma = std::sqrt(made->covariances[camera](i, i));
      EXPECT_GT(sigma, 0) << kIntrinsicNames[static_cast<size_t>(i)];
      EXPECT_LT(std::abs(found[static_cast<size_t>(i)] - right[static_cast<size_t>(i)]), 4 * sigma)
          << camera << kIntrinsicNames[static_cast<size_t>(i)];
    }
    EXPECT_NEAR(scene.cameras[camera].fx / truth.cameras[camera].fx, 1, 0.002);
  }
}

TEST(PlaneAdjustment, FromAPoorStart) {
  const SyntheticSession session = MakeSession({.noise_px = 0.1, .seed = 2});
  PlaneScene scene = SceneOf(session);
  scene.camera().fx = scene.camera().fy = 1.04 * session.truth.fx;
  scene.camera().cx += 40;
  scene.camera().k1 *= 0.5;
  scene.camera().k2 = 0;
  scene.camera().u0 = scene.camera().cx;
  scene.camera().v0 = scene.camera().cy;
  for (Eigen::Vector3d& p : scene.points) p.z() = 0;
  const auto observations = ObservationsOf(session);
  const auto made = AdjustPlane(observations, {}, &scene);
  ASSERT_TRUE(made.ok()) << made.status().message();
  EXPECT_TRUE(made->is_determined);
  EXPECT_NEAR(scene.camera().fx / session.truth.fx, 1, 0.001);
  EXPECT_EQ(scene.camera().fx, scene.camera().fy);
  EXPECT_LT(LargestDistortionError(scene.camera(), session.truth), 1.5);
  EXPECT_NEAR(made->sigma_scale, 1, 0.1);  // the sigmas given were right
  ASSERT_EQ(made->residuals_px.size(), observations.size());
  double sum = 0;
  for (const Eigen::Vector2d& r : made->residuals_px)
    sum += r.squaredNorm() / (2. * observations.size());
  EXPECT_NEAR(std::sqrt(sum), 0.1, 0.025);  // a part of the noise goes into the parameters
}

TEST(PlaneAdjustment, StandardDeviationsAreThoseOfRepeatedExperiments) {
  constexpr int kTimes = 40;
  const SyntheticSession exact = MakeSession({.photo_count = 8, .noise_px = 1e-9, .seed = 3});
  Eigen::Matrix<double, 8, 1> in_sigma2 = Eigen::Matrix<double, 8, 1>::Zero();
  for (uint64_t i = 0; i < kTimes; ++i) {
    // The same session with other noise: MakeSession's photos do not depend on the noise's size.
    std::vector<PlaneObservation> observations = ObservationsOf(exact);
    SeededRandom random(i);
    for (PlaneObservation& o : observations) {
      o.sigma_px = 0.2;
      for (int k = 0; k < 2; ++k) {  // the sum of 12 uniform numbers has a variance of 1
        double sum = -6;
        for (int j = 0; j < 12; ++j) sum += random.Unit();
        o.px[k] += 0.2 * sum;
      }
    }
    CompactScene seen =
        Compact(observations, {std::vector<bool>(observations.size(), true), {}}, SceneOf(exact));
    const auto made = AdjustPlane(seen.observations, {}, &seen.scene);
    ASSERT_TRUE(made.ok() && made->is_determined);
    const auto ours = IntrinsicsOf(seen.scene.camera()), truth = IntrinsicsOf(exact.truth);
    for (int k = 0; k < 8; ++k) {
      const auto at = static_cast<size_t>(k);
      in_sigma2[k] += std::pow(ours[at] - truth[at], 2) / made->covariance()(k, k) / kTimes;
    }
  }
  for (int k = 0; k < 8; ++k) {  // chi-squared of 40 over 40 lies in 0.5..1.7 in 99.8 of 100 cases;
                                 // priors bias a little
    EXPECT_GT(in_sigma2[k], 0.45) << kIntrinsicNames[static_cast<size_t>(k)];
    EXPECT_LT(in_sigma2[k], 2.0) << kIntrinsicNames[static_cast<size_t>(k)];
  }
}

TEST(PlaneAdjustment, WrongSigmasAreFoundOut) {
  const SyntheticSession session = MakeSession({.noise_px = 0.2, .seed = 4});
  std::vector<PlaneObservation> observations = ObservationsOf(session);
  for (PlaneObservation& o : observations) o.sigma_px = 0.1;
  PlaneScene scene = SceneOf(session);
  const auto made = AdjustPlane(observations, {}, &scene);
  ASSERT_TRUE(made.ok());
  EXPECT_NEAR(made->sigma_scale, 2, 0.2);
}

TEST(PlaneAdjustment, AnOpenParameterIsSaid) {
  // One photo of one plane: focal length and distance cannot be told apart well, and a second point
  // is all there is.
  const SyntheticSession session = MakeSession({.photo_count = 3, .seed = 5});
  std::vector<PlaneObservation> few;
  for (const PlaneObservation& o : ObservationsOf(session)) {
    if (o.view == 0 && few.size() < 3) few.push_back(o);
  }
  ObservationChoice choice{std::vector<bool>(few.size(), true), {}};
  PlaneScene scene = Compact(few, choice, SceneOf(session)).scene;
  const auto made = AdjustPlane(Compact(few, choice, SceneOf(session)).observations, {}, &scene);
  EXPECT_TRUE(!made.ok() || !made->is_determined);
  PlaneScene none;
  EXPECT_FALSE(AdjustPlane({}, {}, &none).ok());
}

TEST(ViewFocal, AnotherZoomStandsOut) {
  const SyntheticSession session = MakeSession({.noise_px = 0.1, .tilt_deg_min = 30, .seed = 6});
  const auto observations = ObservationsOf(session);
  const ViewFocal same = EstimateViewFocal(observations, SceneOf(session), 2);
  EXPECT_LT(std::abs(same.focal_px - session.truth.fx), 4 * same.sigma_px);
  EXPECT_LT(same.sigma_px, 0.01 * session.truth.fx);
  EXPECT_NEAR(same.error_sigmas, 1, 0.3);
  PlaneScene wrong = SceneOf(session);
  wrong.camera().fx = wrong.camera().fy = 0.9 * session.truth.fx;
  const ViewFocal other = EstimateViewFocal(observations, wrong, 2);
  EXPECT_NEAR(other.focal_px / session.truth.fx, 1, 0.02);
  EXPECT_GT(std::abs(other.focal_px - wrong.camera().fx), 6 * other.sigma_px);
  EXPECT_TRUE(std::isinf(EstimateViewFocal({}, wrong, 2).sigma_px));
}

TEST(ObservationChoice, PhotosAndPointsThatDoNotFit) {
  // Views 0 to 2 see points 0 to 9; view 1 fits badly; point 9 fits in one view alone; view 2 is
  // out from before.
  std::vector<PlaneObservation> observations;
  std::vector<double> errors;
  for (uint32_t v = 0; v < 4; ++v) {
    for (uint32_t p = 0; p < 10; ++p) {
      observations.push_back({v, p, {0, 0}, 1});
      errors.push_back(v == 1 && p < 6 ? 3 : v == 3 && p == 9 ? std::nan("") : 0.5);
    }
  }
  ObservationChoice choice;
  choice.why_left_out = {"", "", "blurred", ""};
  ChooseObservations(observations, errors, {}, &choice);
  EXPECT_EQ(choice.why_left_out[0], "");
  EXPECT_NE(choice.why_left_out[1].find("only 4 of its 10 points fit"), std::string::npos);
  EXPECT_EQ(choice.why_left_out[2], "blurred");
  EXPECT_EQ(choice.why_left_out[3], "");
  for (size_t i = 0; i < observations.size(); ++i) {
    const bool expected =
        (observations[i].view == 0 || observations[i].view == 3) && observations[i].point < 9;
    EXPECT_EQ(choice.is_used[i], expected) << i;
  }
  PlaneScene whole;
  whole.cams_from_world.resize(4);
  for (int p = 0; p < 10; ++p) whole.points.emplace_back(p, 0, 0);
  CompactScene compact = Compact(observations, choice, whole);
  EXPECT_EQ(compact.views, (std::vector<uint32_t>{0, 3}));
  EXPECT_EQ(compact.points.size(), 9u);
  compact.scene.points[4].y() = 7;
  compact.scene.cams_from_world[1].translation.x() = 5;
  Expand(compact, &whole);
  EXPECT_EQ(whole.points[4].y(), 7);
  EXPECT_EQ(whole.cams_from_world[3].translation.x(), 5);
}

TEST(Readmission, LostPhotosAndPointsAreFoundAgain) {
  const SyntheticSession session = MakeSession({.noise_px = 0.05, .sheet_height_mm = 0, .seed = 8});
  const auto observations = ObservationsOf(session);
  PlaneScene scene = SceneOf(session);
  scene.cams_from_world[3].translation.setConstant(std::nan(""));
  scene.points[20].setConstant(std::nan(""));
  ObservationChoice choice;
  for (const PlaneObservation& o : observations)
    choice.is_used.push_back(o.view != 3 && o.point != 20);
  std::vector<std::string> never(session.input.views.size());
  PlaneScene held = scene;
  never[3] = "another camera";
  PlaceWhatWasLeftOut(observations, choice, never, &held);
  EXPECT_FALSE(held.cams_from_world[3].translation.allFinite());
  PlaceWhatWasLeftOut(observations, choice, std::vector<std::string>(never.size()), &scene);
  EXPECT_LT((scene.cams_from_world[3].Center() - session.cams_from_world[3].Center()).norm(), 0.01);
  EXPECT_LT((scene.points[20] - session.points[20]).norm(), 0.001);
  EXPECT_EQ(scene.points[0], session.points[0]);
}

}  // namespace
}  // namespace veduta
