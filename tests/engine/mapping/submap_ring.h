// SPDX-License-Identifier: Apache-2.0
#pragma once
// Submaps on a ring, each carried away from the truth by a similarity that grows along the ring,
// with ties between neighbours. Some of them may stand elsewhere as one body.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "engine/mapping/relaxation_problem.h"
#include "engine/mapping/similarity.h"
#include "tests/engine/mapping/synthetic_scene.h"

namespace veduta {

inline constexpr uint32_t kSubmaps = 8, kCameras = 6;  // cameras of each submap
inline constexpr uint32_t kLoneCamera = 2;
inline constexpr double kRadius = 40;

struct RingOptions {
  double drift = 0;  // of each submap against the one before: rad and metres
  double noise_px = 0;
  double wrong_share = 0;
  uint32_t ties = 40;                           // between two neighbours
  std::optional<uint32_t> lone = std::nullopt;  // a submap of which one camera sees all
  // there_from_here of submaps that stand elsewhere.
  std::map<uint32_t, Sim3> torn = {};
  uint64_t seed = 7;
};

// A camera on the ring at `turns`, which looks outwards.
inline Rigid3 CameraAt(double turns) {
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

inline Pinhole RingCamera() {
  Pinhole camera;
  camera.fx = camera.fy = 700;
  camera.cx = 500;
  camera.cy = 400;
  return camera;
}

inline Ring MakeRing(const RingOptions& options) {
  Ring ring;
  Sim3 now_from_truth;
  for (uint32_t s = 0; s < kSubmaps; ++s) {
    auto& truth = ring.truth.emplace_back();
    auto& now = ring.now.emplace_back();
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    for (uint32_t c = 0; c < kCameras; ++c) {
      truth.push_back(CameraAt((s + (c + 0.5) / kCameras) / kSubmaps));
      const auto torn = options.torn.find(s);
      const Sim3 there_from_here = torn == options.torn.end() ? Sim3() : torn->second;
      now.push_back(TransformCameraWorld(there_from_here * now_from_truth, truth.back()));
      center += now.back().Center() / kCameras;
    }
    ring.problem.centers.push_back(center);
    const Sim3 drift{1 + options.drift,
                     Eigen::Quaterniond(Eigen::AngleAxisd(
                         options.drift, Eigen::Vector3d(0.3, 1, -0.2).normalized())),
                     Eigen::Vector3d(options.drift, 0, -options.drift)};
    now_from_truth = drift * now_from_truth;
  }
  SeededRandom random(options.seed);
  for (uint32_t s = 0; s < kSubmaps; ++s) {
    const uint32_t next = (s + 1) % kSubmaps;
    // Hardly a point spans a seam.
    const bool is_seam = options.torn.contains(s) != options.torn.contains(next);
    ring.problem.pairs.push_back({s, next, is_seam ? 5u : 200u});
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
        view.image = ImageId(1 + submap * kCameras + camera);
        view.camera = RingCamera();
        view.cam_from_world = ring.now[submap][camera];
        const Eigen::Vector3d x = ring.truth[submap][camera] * place;
        view.x_px = {view.camera.fx * x.x() / x.z() + view.camera.cx,
                     view.camera.fy * x.y() / x.z() + view.camera.cy};
        const double noise_x = Gaussian(random), noise_y = Gaussian(random);
        view.x_px += options.noise_px * Eigen::Vector2d(noise_x, noise_y);
        if (is_wrong && submap == next) view.x_px.x() += 30 + 30 * random.Unit();
        ring.problem.views.push_back(view);
      }
      ring.problem.first_view.push_back(static_cast<uint32_t>(ring.problem.views.size()));
    }
  }
  return ring;
}

// The largest distance of a camera from the truth, after the similarity that fits all best.
inline double WorstCenter(const Ring& ring, const std::vector<Sim3>& new_from_old) {
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

}  // namespace veduta
