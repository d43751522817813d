// SPDX-License-Identifier: Apache-2.0
// Goal: nothing but results may reach standard output, so neither the calibration nor the libraries
//   that it uses (Ceres, and CHOLMOD beneath it; OpenCV) ever write there, however little the
//   photos tell.
// Method: file descriptor 1 captured while sessions are calibrated that leave much open, while each
//   step that uses Ceres solves a problem whose matrix is singular, and while camera files of noise
//   are read. The capture itself is shown to see a library's output: CHOLMOD's own words for a
//   matrix that is not positive definite.
#include <gtest/gtest.h>
#include <suitesparse/cholmod.h>

#include "engine/camera/calibration/calibrator.h"
#include "engine/camera/calibration/distortion_estimation.h"
#include "engine/camera/calibration/homography.h"
#include "engine/camera/calibration/known_camera.h"
#include "engine/camera/calibration/view_focal.h"
#include "tests/engine/camera/mutated_text.h"
#include "tests/engine/camera/standard_output.h"
#include "tools/bench/calibration/synthetic_session.h"

namespace veduta {
namespace {

using testing::StandardOutputOf;

TEST(StandardOutput, TheCaptureSeesWhatCholmodPrints) {
  const std::string written = StandardOutputOf([] {
    cholmod_common common;
    cholmod_start(&common);
    common.supernodal = CHOLMOD_SUPERNODAL;  // L L^T; the simplicial L D L^T takes any sign
    cholmod_sparse* matrix = cholmod_speye(3, 3, CHOLMOD_REAL, &common);
    matrix->stype = 1;
    static_cast<double*>(matrix->x)[1] = -1;  // diag(1, -1, 1)
    cholmod_factor* factor = cholmod_analyze(matrix, &common);
    cholmod_factorize(matrix, factor, &common);
    cholmod_free_factor(&factor, &common);
    cholmod_free_sparse(&matrix, &common);
    cholmod_finish(&common);
  });
  EXPECT_NE(written.find("not positive definite"), std::string::npos) << written;
}

TEST(StandardOutput, PoorSessionsPrintNothing) {
  uint32_t made = 0, refused = 0;
  EXPECT_EQ(StandardOutputOf([&] {
              for (uint32_t i = 0; i < 12; ++i)
                ++(CalibrateCamera(MakePoorSession(i).input).ok() ? made : refused);
            }),
            "");
  EXPECT_GT(made, 0u);
  EXPECT_GT(refused, 0u);
}

// Views that all look from one place: distortion and homographies are open.
std::vector<PlanarView> EqualViews(size_t count) {
  PlanarView view;
  for (uint32_t p = 0; p < 40; ++p)
    view.push_back({p, {0.1 * (p % 8) - 0.35, 0.1 * (p / 8) - 0.2}, 0.001});
  return std::vector<PlanarView>(count, view);
}

TEST(StandardOutput, SingularProblemsPrintNothing) {
  EXPECT_EQ(StandardOutputOf([] {
              const std::vector<PlanarView> views = EqualViews(5);
              ViewTree tree = GrowViewTree(views);
              // A prior too weak to be seen beside the observations, and one that overflows.
              for (const double sigma : {1e150, 1e-200}) {
                DistortionOptions options;
                options.center_sigma = options.coefficient_sigma = sigma;
                EstimateDistortion(views, options, &tree)
                    .status()
                    .IgnoreBecause("only what it prints is looked at");
              }
              const std::vector<Eigen::Vector2d> one_place(10, {0.1, 0.2});
              const std::vector<double> sigmas(10, 1);
              RefineHomography(Eigen::Matrix3d::Identity(), one_place, one_place, sigmas, sigmas);
              RefineHomography(Eigen::Matrix3d::Ones(), one_place, one_place, sigmas, sigmas);
            }),
            "");
}

TEST(StandardOutput, AdjustmentsOfTooLittlePrintNothing) {
  const SyntheticSession session = MakeSession({.photo_count = 3, .seed = 5});
  std::vector<PlaneObservation> few;
  for (const PointObservation& p : session.input.views[0].points)
    if (few.size() < 3) few.push_back({0, static_cast<uint32_t>(few.size()), p.px, p.sigma_px});
  EXPECT_EQ(
      StandardOutputOf([&] {
        PlaneScene scene{{session.truth}, {}, {session.cams_from_world[0]}, {}};
        for (int i = 0; i < 3; ++i) scene.points.emplace_back(0.1 * i, 0, 0);
        AdjustPlane(few, {}, &scene).status().IgnoreBecause("only what it prints is looked at");
        EstimateViewFocal(few, scene, 0);
        scene.points.assign(3, Eigen::Vector3d::Zero());
        AdjustPlane(few, {}, &scene).status().IgnoreBecause("only what it prints is looked at");
      }),
      "");
}

TEST(StandardOutput, CameraFilesOfNoisePrintNothing) {
  const std::string good =
      "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: [500, 0, 320, 0, 500, "
      "240, 0, 0, 1]\ndistortion_coefficients: [-0.2, 0.05, 0.01, 0.003]\n";
  SeededRandom random(3);
  EXPECT_EQ(StandardOutputOf([&] {
              for (int i = 0; i < 300; ++i) {
                const auto known = ParseOpenCvCamera(testing::MutatedText(good, &random));
                if (known.ok() && i % 10 == 0)
                  ConvertCamera(*known).status().IgnoreBecause("only what it prints is looked at");
              }
            }),
            "");
}

}  // namespace
}  // namespace veduta
