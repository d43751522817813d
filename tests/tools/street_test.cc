// SPDX-License-Identifier: Apache-2.0
// Goal: the synthetic street tells the truth: poses, intrinsics, distortion and depth fit the
//   pictures, and a place looks like no other (unless asked for).
// Method: render small photos; carry pixels from one to another by their depth and compare what
//   arrives; compare shading results bit by bit between instruction sets.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include "storage/base/cpu_isa.h"
#include "street_view.h"
#include "tools/render/street/truth_file.h"

namespace veduta::street {
namespace {

TEST(Street, EveryInstructionSetGivesTheSameBits) {
  const ShaderKernels& portable = *FindShaderKernels(CpuIsa::kPortable);
  SeededRandom random(5);
  QuadMesh mesh;
  for (int i = 0; i < 200; ++i) {
    const Eigen::Vector3d u =
        Eigen::Vector3d{random.Unit() - 0.5, random.Unit() - 0.5, 0.3}.normalized();
    const Eigen::Vector3d v = u.unitOrthogonal();
    const Eigen::Vector3d corner{20 * random.Unit(), 20 * random.Unit(), 5 * random.Unit()};
    mesh.AddSurface(
        corner, u, v,
        {static_cast<Material>(i % static_cast<int>(Material::kCount)), {0.5, 0.4, 0.3}},
        static_cast<uint32_t>(random.Next()), {1.2, 1.5});
  }
  for (int round = 0; round < 300; ++round) {
    ShadeInput in;
    const bool same = round % 3 == 0;
    const uint32_t fixed = random.Below(200);
    for (int i = 0; i < kLanes; ++i) {
      for (auto& component : in.direction) component[i] = static_cast<float>(random.Unit() * 2 - 1);
      const uint32_t pick = same ? fixed : random.Below(220);
      in.surface[i] = pick < 200 ? &mesh.surfaces()[pick] : nullptr;
    }
    for (float& o : in.origin) o = static_cast<float>(random.Unit() * 10);
    in.pixel_angle = 0.002f;
    ShadeOutput first;
    portable.shade(in, first);
    float linear[3 * 37];
    uint8_t first_toned[3 * 37];
    for (float& x : linear) x = static_cast<float>(random.Unit());
    portable.tone({linear, first_toned, 37, 5, {1.1f, 1, 0.9f}, 3, 77});
    for (const CpuIsa isa : kCpuIsas) {
      const ShaderKernels* kernels = FindShaderKernels(isa);
      if (kernels == nullptr) continue;
      ShadeOutput out;
      uint8_t toned[3 * 37];
      kernels->shade(in, out);
      ASSERT_EQ(std::memcmp(&first, &out, sizeof out), 0) << CpuIsaName(isa) << ", round " << round;
      kernels->tone({linear, toned, 37, 5, {1.1f, 1, 0.9f}, 3, 77});
      ASSERT_EQ(std::memcmp(first_toned, toned, sizeof toned), 0) << CpuIsaName(isa);
    }
  }
}

TEST(Street, NoiseHasTheSigmaAskedFor) {
  std::vector<float> linear(
      30000 * 3, 0.25f);  // grey 127.5: where coarse noise would round away from the mean
  std::vector<uint8_t> out(linear.size());
  for (const float sigma : {2.0f, 4.0f, 9.0f}) {
    BestShaderKernels().tone({linear.data(), out.data(), 30000, 0, {1, 1, 1}, sigma, 9});
    double sum = 0, squares = 0;
    for (const uint8_t x : out) sum += x, squares += double{1} * x * x;
    const double mean = sum / out.size();
    EXPECT_NEAR(mean, 127.5, 0.02 * sigma);
    EXPECT_NEAR(std::sqrt(squares / out.size() - mean * mean), std::sqrt(sigma * sigma + 1.0 / 12),
                0.015 * sigma);
  }
}

// Points of one photo, carried into another by its depth, meet the same surface in the same colour.
void ExpectPhotosAgree(const View& a, const View& b) {
  int inside = 0, same = 0, through = 0;
  double difference = 0, difference_elsewhere = 0;
  SeededRandom random(3);
  for (uint32_t v = 2; v + 2 < a.photo.height_px; v += 2) {
    for (uint32_t u = 2; u + 2 < a.photo.width_px; u += 2) {
      if (a.photo.depth[size_t{v} * a.photo.width_px + u] <= 0) continue;
      const Eigen::Vector3d in_b = b.camera.cam_from_world * a.PointInWorld(u, v);
      if (in_b.z() < 0.1) continue;
      const Eigen::Vector2d at = Distorted(b.camera.model, in_b);
      if (!b.Inside(at)) continue;
      ++inside;
      const double tolerance = 0.02 * in_b.z();
      const double depth = b.DepthAt(at);
      if (depth == 0 || depth > in_b.z() + tolerance) ++through;  // b looks through what a sees
      if (std::abs(depth - in_b.z()) > tolerance) continue;
      ++same;
      const double grey = a.GreyAt(Eigen::Vector2d(u, v));
      difference += std::abs(grey - b.GreyAt(at));
      difference_elsewhere += std::abs(grey - b.GreyAt({random.Unit() * 300, random.Unit() * 220}));
    }
  }
  ASSERT_GT(inside, 2000);
  EXPECT_LT(through, 0.02 * inside);
  EXPECT_GT(same, 0.7 * inside);
  EXPECT_LT(difference / same, 9);
  EXPECT_LT(difference / same, 0.35 * difference_elsewhere / same);
}

TEST(Street, DepthAndColourAgreeBetweenPhotos) {
  const SceneOptions options = SceneForTrajectory(Trajectory::kStreet, 24, 20);
  const auto scene = Build(options);
  for (const CameraModel& model : {MakeModel(320, 240, 280), MakeDistortedModel()}) {
    RigOptions rig;
    rig.model = model;
    rig.photos = 24;
    const auto cameras = MakeCameras(options, rig).value();
    for (const size_t i : {1u, 6u, 14u})
      ExpectPhotosAgree(Take(*scene, cameras[i]), Take(*scene, cameras[i + 1]));
  }
}

TEST(Street, DistortedPhotoIsTheStraightOneBent) {
  const auto scene = Build(SceneForTrajectory(Trajectory::kStreet, 24, 20));
  CameraModel bent = MakeDistortedModel(), straight = bent;
  straight.k1 = straight.k2 = 0;
  const Rigid3 pose = LookFrom({5, -2, 1.7}, 80, 8, 1);
  const View a = Take(*scene, {"straight", straight, pose}), b = Take(*scene, {"bent", bent, pose});
  int count = 0, depth_equal = 0, unmoved_equal = 0;
  double moved_px_max = 0;
  for (uint32_t v = 0; v < a.photo.height_px; v += 2) {
    for (uint32_t u = 0; u < a.photo.width_px; u += 2) {
      const double z = a.photo.depth[size_t{v} * a.photo.width_px + u];
      const Eigen::Vector3d ray((u - straight.cx) / straight.fx, (v - straight.cy) / straight.fy,
                                1);
      const Eigen::Vector2d at = Distorted(bent, ray);
      EXPECT_LT((ProjectPoint(bent, ray) - at).norm(), 1e-9);
      if (z <= 0 || !b.Inside(at)) continue;
      ++count;
      const Eigen::Vector2d here(u, v);
      moved_px_max = std::max(moved_px_max, (at - here).norm());
      depth_equal +=
          std::abs(b.GreyAt(at) - a.GreyAt(here)) < 12 && std::abs(b.DepthAt(at) - z) < 0.02 * z;
      unmoved_equal += std::abs(b.GreyAt(b.Inside(here) ? here : at) - a.GreyAt(here)) < 12;
    }
  }
  EXPECT_GT(moved_px_max, 8);  // the test has something to see
  EXPECT_GT(depth_equal, 0.85 * count);
  EXPECT_LT(unmoved_equal, 0.7 * count);
}

TEST(Street, RayTableInvertsTheForwardModel) {
  const CameraModel model = MakeDistortedModel();
  const RayTable table = MakeRayTable(model).value();
  for (uint32_t v = 0; v < model.height_px; ++v) {
    for (uint32_t u = 0; u < model.width_px; ++u) {
      const size_t i = size_t{v + 1} * table.stride() + u + 1;
      ASSERT_LT((Distorted(model, {table.x[i], table.y[i], 1}) - Eigen::Vector2d(u, v)).norm(),
                1e-4);
    }
  }
  CameraModel folding = model;
  folding.k1 = -1.5;
  EXPECT_EQ(MakeRayTable(folding).status().code(), StatusCode::kInvalidArgument);
}

// Zero-mean correlation of two photos' grey values in the window [u, u + size) x [v, v + size) of
// each.
double Correlation(const StreetPhoto& a, const StreetPhoto& b, Eigen::Vector2i at_a,
                   Eigen::Vector2i at_b, int size) {
  double sa = 0, sb = 0, saa = 0, sbb = 0, sab = 0;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const double p = a.rgb[((at_a.y() + y) * size_t{a.width_px} + at_a.x() + x) * 3 + 1];
      const double q = b.rgb[((at_b.y() + y) * size_t{b.width_px} + at_b.x() + x) * 3 + 1];
      sa += p, sb += q, saa += p * p, sbb += q * q, sab += p * q;
    }
  }
  const double n = size * size;
  return (n * sab - sa * sb) / std::sqrt((n * saa - sa * sa) * (n * sbb - sb * sb));
}

// Looks square at the upper floors, above the trees.
StreetPhoto FacadeAt(const Scene& scene, double x) {
  return Take(scene, {"facade", MakeModel(320, 240, 900), LookFrom({x, -2, 6.6}, 90, 0, 0)}).photo;
}

TEST(Street, NoTwoPlacesLookAlike) {
  const auto scene = Build(SceneForTrajectory(Trajectory::kStreet, 72, 60));
  std::vector<StreetPhoto> photos;
  for (int i = 0; i < 6; ++i) photos.push_back(FacadeAt(*scene, 9.5 * i));
  SeededRandom random(11);
  double sum = 0, largest = 0;
  int count = 0;
  for (; count < 400; ++count) {
    const uint32_t i = random.Below(6), j = (i + 1 + random.Below(5)) % 6;
    const auto corner = [&] {
      return Eigen::Vector2i{random.Below(320 - 64), random.Below(240 - 64)};
    };
    const double correlation = std::abs(Correlation(photos[i], photos[j], corner(), corner(), 64));
    sum += correlation;
    largest = std::max(largest, correlation);
  }
  EXPECT_LT(sum / count, 0.2);
  EXPECT_LT(largest, 0.85);
  EXPECT_GT(Correlation(photos[0], FacadeAt(*scene, 0), {50, 50}, {50, 50}, 64), 0.999);
}

TEST(Street, RepeatedWindowsRepeat) {
  SceneOptions options = SceneForTrajectory(Trajectory::kStreet, 72, 60);
  options.repeated_windows = true;
  const auto scene = Build(options);
  const StreetPhoto here = FacadeAt(*scene, 6);
  for (const int periods : {1, 3, 11}) {
    const StreetPhoto there = FacadeAt(*scene, 6 + periods * kRepeatPeriodM);
    EXPECT_GT(Correlation(here, there, {0, 0}, {0, 0}, 240), 0.98) << periods;
  }
  EXPECT_LT(Correlation(here, FacadeAt(*scene, 6 + 0.4 * kRepeatPeriodM), {0, 0}, {0, 0}, 240),
            0.6);
}

// In how many of the other views a point that view `i` sees is seen too.
int TimesSeen(const std::vector<View>& views, size_t i, uint32_t u, uint32_t v, size_t from,
              size_t to) {
  const Eigen::Vector3d point = views[i].PointInWorld(u, v);
  int seen = 0;
  for (size_t j = from; j < to; ++j) {
    const Eigen::Vector3d in_cam = views[j].camera.cam_from_world * point;
    if (in_cam.z() < 0.1) continue;
    const Eigen::Vector2d at = Distorted(views[j].camera.model, in_cam);
    seen += views[j].Inside(at) && std::abs(views[j].DepthAt(at) - in_cam.z()) < 0.03 * in_cam.z();
  }
  return seen;
}

std::vector<View> WalkThrough(const SceneOptions& options, const RigOptions& rig) {
  const auto scene = Build(options);
  std::vector<View> views;
  const auto cameras = MakeCameras(options, rig).value();
  for (const StreetCamera& camera : cameras) views.push_back(Take(*scene, camera));
  return views;
}

TEST(Street, APointIsSeenInSeveralPhotos) {
  for (const Trajectory trajectory : {Trajectory::kStreet, Trajectory::kLoop, Trajectory::kOrbit}) {
    RigOptions rig;
    rig.trajectory = trajectory;
    rig.model = MakeModel(128, 96, 112);
    const std::vector<View> views = WalkThrough(SceneForTrajectory(trajectory, rig.photos, 0), rig);
    std::vector<int> seen;
    for (size_t i = 0; i < views.size(); i += 5) {
      for (uint32_t v = 8; v < 96; v += 16) {
        for (uint32_t u = 8; u < 128; u += 16) {
          const double z = views[i].photo.depth[v * 128 + u];
          if (z > 0 && z < 20) seen.push_back(TimesSeen(views, i, u, v, 0, views.size()));
        }
      }
    }
    std::sort(seen.begin(), seen.end());
    ASSERT_GT(seen.size(), 200u);
    EXPECT_GE(seen[seen.size() / 2], 4) << static_cast<int>(trajectory);
    // Around a house everyone looks at the same four walls.
    EXPECT_LE(seen[seen.size() / 2], trajectory == Trajectory::kOrbit ? 36 : 16)
        << static_cast<int>(trajectory);
    std::printf("trajectory %d: a point is seen in %d (%d to %d) photos\n",
                static_cast<int>(trajectory), seen[seen.size() / 2], seen[seen.size() / 10],
                seen[seen.size() * 9 / 10]);
    EXPECT_GE(seen[seen.size() / 10], 2) << static_cast<int>(trajectory);
  }
}

TEST(Street, TwoSitesShareNothingUntilTheBridge) {
  RigOptions rig;
  rig.trajectory = Trajectory::kTwoSites;
  rig.model = MakeModel(128, 96, 112);
  rig.photos = 60;
  const SceneOptions options = SceneForTrajectory(rig.trajectory, rig.photos, 0);
  const std::vector<View> views = WalkThrough(options, rig);
  double end_of_first = 0, begin_of_second = 1e9;
  size_t first = 0;
  while (views[first + 1].camera.cam_from_world.Center().x() <
         views[first].camera.cam_from_world.Center().x() + 10) {
    end_of_first = views[++first].camera.cam_from_world.Center().x();
  }
  size_t second = ++first;
  begin_of_second = views[second].camera.cam_from_world.Center().x();
  while (views[second].camera.cam_from_world.Center().x() > begin_of_second - 1) ++second;
  ASSERT_GT(begin_of_second, end_of_first + 25);
  ASSERT_LT(second, views.size());  // the rest is the bridge
  int shared = 0, bridged = 0, count = 0;
  for (size_t i = 0; i < first; ++i) {
    for (uint32_t v = 4; v < 96; v += 8) {
      for (uint32_t u = 4; u < 128; u += 8) {
        if (views[i].photo.depth[v * 128 + u] <= 0) continue;
        ++count;
        shared += TimesSeen(views, i, u, v, first, second) > 0;
        bridged += TimesSeen(views, i, u, v, second, views.size()) > 0;
      }
    }
  }
  EXPECT_LT(shared, 0.002 * count);
  EXPECT_GT(bridged, 0.02 * count);
  rig.bridge = false;
  const auto without = MakeCameras(options, rig).value();
  EXPECT_EQ(without.size(), 60u);
  for (const StreetCamera& camera : without) {
    const double x = camera.cam_from_world.Center().x();
    EXPECT_TRUE(x < end_of_first + 2 || x > begin_of_second - 2) << x;
  }
}

TEST(Street, LookFromPutsTheHorizonLevel) {
  const Rigid3 pose = LookFrom({3, 4, 1.7}, 30, 0, 0);
  EXPECT_LT((pose.Center() - Eigen::Vector3d(3, 4, 1.7)).norm(), 1e-12);
  const Eigen::Vector3d ahead =
      pose * Eigen::Vector3d(3 + std::cos(M_PI / 6), 4 + std::sin(M_PI / 6), 1.7);
  EXPECT_LT((ahead - Eigen::Vector3d(0, 0, 1)).norm(), 1e-12);
  EXPECT_LT((pose * Eigen::Vector3d(3, 4, 2.7) - Eigen::Vector3d(0, -1, 0)).norm(), 1e-12);
  EXPECT_NEAR(pose.rotation.toRotationMatrix().determinant(), 1, 1e-12);
}

}  // namespace
}  // namespace veduta::street
