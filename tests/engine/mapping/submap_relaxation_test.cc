// SPDX-License-Identifier: Apache-2.0
// Goal: drift over a loop of submaps is spread until the places between them fit, also where the
//   two ends have come far apart and where some ties are wrong; errors of measurement alone move
//   nothing; what nothing ties stays; the same bits come out again.
// Method: submaps on a ring, each carried away from the truth by a similarity that grows along the
//   ring, with ties between neighbours.
#include "engine/mapping/submap_relaxation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "engine/mapping/similarity.h"
#include "tests/engine/mapping/synthetic_scene.h"

namespace veduta {
namespace {

constexpr uint32_t kSubmaps = 8, kCameras = 6;  // cameras of each submap
constexpr uint32_t kLoneCamera = 2;
constexpr double kRadius = 40;

struct RingOptions {
  double drift = 0;  // of each submap against the one before: rad and metres
  double noise_px = 0;
  double wrong_share = 0;
  uint32_t ties = 40;                           // between two neighbours
  std::optional<uint32_t> lone = std::nullopt;  // a submap of which one camera sees all
};

// A camera on the ring at `turns`, which looks outwards.
Rigid3 CameraAt(double turns) {
  const double angle = 2 * M_PI * turns;
  const Eigen::Vector3d out(std::cos(angle), 0, std::sin(angle)), down(0, 1, 0);
  Eigen::Matrix3d rotation;
  rotation << down.cross(out).transpose(), down.transpose(), out.transpose();
  const Eigen::Quaterniond q(rotation);
  return {q, -(q * (kRadius * out))};
}

struct Ring {
  RelaxationProblem problem;
  std::vector<std::vector<Rigid3>> truth, now;  // [submap][camera]
};

Pinhole RingCamera() {
  Pinhole camera;
  camera.fx = camera.fy = 700;
  camera.cx = 500;
  camera.cy = 400;
  return camera;
}

Ring MakeRing(const RingOptions& options) {
  Ring ring;
  Sim3 now_from_truth;
  for (uint32_t s = 0; s < kSubmaps; ++s) {
    auto& truth = ring.truth.emplace_back();
    auto& now = ring.now.emplace_back();
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    for (uint32_t c = 0; c < kCameras; ++c) {
      truth.push_back(CameraAt((s + (c + 0.5) / kCameras) / kSubmaps));
      now.push_back(TransformCameraWorld(now_from_truth, truth.back()));
      center += now.back().Center() / kCameras;
    }
    ring.problem.centers.push_back(center);
    const Sim3 drift{1 + options.drift,
                     Eigen::Quaterniond(Eigen::AngleAxisd(
                         options.drift, Eigen::Vector3d(0.3, 1, -0.2).normalized())),
                     Eigen::Vector3d(options.drift, 0, -options.drift)};
    now_from_truth = drift * now_from_truth;
  }
  SeededRandom random(7);
  for (uint32_t s = 0; s < kSubmaps; ++s) {
    const uint32_t next = (s + 1) % kSubmaps;
    for (uint32_t tie = 0; tie < options.ties; ++tie) {
      const double angle = 2 * M_PI * (s + 0.9 + 0.2 * random.Unit()) / kSubmaps;
      const double distance = kRadius + 40 + 40 * random.Unit();
      const Eigen::Vector3d place(distance * std::cos(angle), 10 * random.Unit() - 5,
                                  distance * std::sin(angle));
      const bool is_wrong = random.Unit() < options.wrong_share;
      for (const auto& [submap, some_camera] :
           {std::pair(s, kCameras - 3), std::pair(s, kCameras - 1), std::pair(next, 0u),
            std::pair(next, 2u)}) {
        const uint32_t camera = options.lone == submap ? kLoneCamera : some_camera;
        TieView view;
        view.submap = submap;
        view.camera = RingCamera();
        view.cam_from_world = ring.now[submap][camera];
        const Eigen::Vector3d x = ring.truth[submap][camera] * place;
        view.x_px = {view.camera.fx * x.x() / x.z() + view.camera.cx,
                     view.camera.fy * x.y() / x.z() + view.camera.cy};
        view.x_px += options.noise_px * Eigen::Vector2d(Gaussian(random), Gaussian(random));
        if (is_wrong && submap == next) view.x_px.x() += 30 + 30 * random.Unit();
        ring.problem.views.push_back(view);
      }
      ring.problem.first_view.push_back(static_cast<uint32_t>(ring.problem.views.size()));
    }
  }
  return ring;
}

// The largest distance of a camera from the truth, after the similarity that fits all best.
double WorstCenter(const Ring& ring, const std::vector<Sim3>& new_from_old) {
  std::vector<Rigid3> truth, now;
  for (uint32_t s = 0; s < kSubmaps; ++s) {
    for (uint32_t c = 0; c < kCameras; ++c) {
      truth.push_back(ring.truth[s][c]);
      now.push_back(TransformCameraWorld(new_from_old[s], ring.now[s][c]));
    }
  }
  const std::optional<Sim3> truth_from_now = FitCameras(now, truth);
  EXPECT_TRUE(truth_from_now.has_value());
  double worst = 0;
  for (size_t i = 0; i < now.size(); ++i)
    worst = std::max(worst, (*truth_from_now * now[i].Center() - truth[i].Center()).norm());
  return worst;
}

const std::vector<Sim3> kNothingMoved(kSubmaps);

TEST(SubmapRelaxation, SpreadsDriftOverALoop) {
  const Ring ring = MakeRing({.drift = 0.002});
  EXPECT_GT(WorstCenter(ring, kNothingMoved), 0.1);
  const auto relaxed = RelaxSubmaps(ring.problem, {});
  ASSERT_TRUE(relaxed.ok());
  EXPECT_TRUE(relaxed->is_significant);
  EXPECT_LT(WorstCenter(ring, relaxed->new_from_old), 1e-5);
  EXPECT_LT(relaxed->cost, 1e-6 * relaxed->initial_cost);
  EXPECT_EQ(relaxed->new_from_old[0].translation, Eigen::Vector3d::Zero());
  for (const double change : relaxed->change_px) EXPECT_GT(change, 0);
}

TEST(SubmapRelaxation, ClosesALoopWhoseEndsAreFarApartThroughNoiseAndWrongTies) {
  const Ring ring = MakeRing({.drift = 0.01, .noise_px = 0.5, .wrong_share = 0.1});
  EXPECT_GT(WorstCenter(ring, kNothingMoved), 1);
  const Ring without_drift = MakeRing({.noise_px = 0.5, .wrong_share = 0.1});
  const auto by_noise = RelaxSubmaps(without_drift.problem, {});
  ASSERT_TRUE(by_noise.ok());
  const auto relaxed = RelaxSubmaps(ring.problem, {});
  ASSERT_TRUE(relaxed.ok());
  EXPECT_TRUE(relaxed->is_significant);
  EXPECT_LT(WorstCenter(ring, relaxed->new_from_old),
            1.2 * WorstCenter(without_drift, by_noise->new_from_old));
}

TEST(SubmapRelaxation, ErrorsOfMeasurementMoveNothing) {
  for (const double noise_px : {0.0, 0.5, 1.5}) {
    const auto relaxed = RelaxSubmaps(MakeRing({.noise_px = noise_px}).problem, {});
    ASSERT_TRUE(relaxed.ok());
    EXPECT_FALSE(relaxed->is_significant) << noise_px;
  }
}

TEST(SubmapRelaxation, ASubmapOfOneCameraKeepsItsScale) {
  for (const double noise_px : {0.0, 0.5}) {
    const Ring ring = MakeRing({.drift = 0.002, .noise_px = noise_px, .lone = 3});
    const auto relaxed = RelaxSubmaps(ring.problem, {});
    ASSERT_TRUE(relaxed.ok());
    EXPECT_TRUE(relaxed->is_significant);
    for (uint32_t s = 0; s < kSubmaps; ++s)
      EXPECT_NEAR(relaxed->new_from_old[s].scale, 1, s == 3 ? 1e-12 : 0.05) << "submap " << s;
    if (noise_px == 0) {
      EXPECT_LT(relaxed->cost, 1e-6 * relaxed->initial_cost);
    }
  }
}

TEST(SubmapRelaxation, WhatNothingTiesStays) {
  Ring ring = MakeRing({.drift = 0.002});
  ring.problem.centers.push_back(Eigen::Vector3d(1, 2, 3));
  const auto relaxed = RelaxSubmaps(ring.problem, {});
  ASSERT_TRUE(relaxed.ok());
  EXPECT_TRUE(relaxed->is_significant);
  EXPECT_EQ(relaxed->new_from_old.back().translation, Eigen::Vector3d::Zero());
  EXPECT_EQ(relaxed->change_px.back(), 0);
  EXPECT_LT(WorstCenter(ring, relaxed->new_from_old), 1e-5);
  RelaxationProblem none;
  none.centers.resize(3, Eigen::Vector3d::Zero());
  const auto nothing = RelaxSubmaps(none, {});
  ASSERT_TRUE(nothing.ok());
  EXPECT_FALSE(nothing->is_significant);
}

TEST(SubmapRelaxation, RepeatsBitForBitAndRefusesBadOptions) {
  const Ring ring = MakeRing({.drift = 0.01, .noise_px = 0.5});
  const auto first = RelaxSubmaps(ring.problem, {}), second = RelaxSubmaps(ring.problem, {});
  ASSERT_TRUE(first.ok());
  ASSERT_TRUE(second.ok());
  for (uint32_t s = 0; s < kSubmaps; ++s)
    EXPECT_EQ(first->new_from_old[s].translation, second->new_from_old[s].translation);
  RelaxationOptions options;
  options.coarse_scale_px = options.loss_scale_px / 2;
  EXPECT_EQ(RelaxSubmaps(ring.problem, options).status().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace veduta
