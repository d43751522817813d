// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos of one synthetic street with their truth, rendered in memory once a process, and an engine
// to add them to.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "engine/engine.h"
#include "engine/query/digest.h"
#include "engine/query/invariants.h"
#include "engine/query/verdict_text.h"
#include "tests/storage/samples.h"
#include "tools/street/camera_rig.h"
#include "tools/street/data_set.h"

namespace veduta {

// Where a photo is taken: metres along the street, in its middle; 90 looks square at the houses on
// the left.
struct Stand {
  double along_m = 0;
  double yaw_deg = 90;
};

struct TakenPhoto {
  std::string name;
  Rigid3 cam_from_world;  // the truth, metres
  std::vector<uint8_t> jpeg;
};

inline CameraModel StreetCameraModel() {
  CameraModel model;
  model.width_px = 512;
  model.height_px = 384;
  model.fx = model.fy = 450;
  model.cx = 255.5;
  model.cy = 191.5;
  model.u0 = model.cx;
  model.v0 = model.cy;
  return model;
}

inline const street::Scene& SharedScene() {
  static const std::unique_ptr<street::Scene> scene = [] {
    street::SceneOptions options;
    options.seed = 7;
    return std::move(*street::BuildScene(options));
  }();
  return *scene;
}

// The same stand gives the same bytes; `exposure_seed` other bytes of the same view. Rendered once
// a process.
inline const TakenPhoto& TakePhoto(const Stand& stand, uint64_t exposure_seed = 1) {
  static std::map<std::tuple<double, double, uint64_t>, TakenPhoto> taken;
  const auto key = std::make_tuple(stand.along_m, stand.yaw_deg, exposure_seed);
  if (const auto it = taken.find(key); it != taken.end()) return it->second;
  const street::Scene& scene = SharedScene();
  const street::Lane& lane = scene.plan().lanes.front();
  const Eigen::Vector2d at = lane.from + stand.along_m * (lane.to - lane.from).normalized();
  // Nobody holds a camera level, or walks a straight line.
  SeededRandom random(static_cast<uint64_t>(std::lround(stand.along_m * 1000)) * 1000 +
                      static_cast<uint64_t>(stand.yaw_deg));
  const auto jitter = [&](double amplitude) { return amplitude * (2 * random.Unit() - 1); };
  street::StreetCamera camera;
  camera.model = StreetCameraModel();
  const Eigen::Vector3d center(at.x(), at.y() + jitter(0.3), 1.6 + jitter(0.1));
  camera.cam_from_world =
      street::LookFrom(center, stand.yaw_deg + jitter(2), 8 + jitter(2), jitter(2));
  street::RenderOptions render;
  render.noise_sigma = 2;
  render.seed = exposure_seed;
  char name[64];
  std::snprintf(name, sizeof(name), "walk/%05.2f_%03.0f.jpg", stand.along_m, stand.yaw_deg);
  auto photo = street::RenderPhoto(scene, camera, render);
  auto jpeg =
      photo.ok() ? street::EncodeJpeg(*photo, 92) : Result<std::vector<uint8_t>>(photo.status());
  EXPECT_OK(jpeg);
  return taken[key] = {name, camera.cam_from_world,
                       jpeg.ok() ? std::move(*jpeg) : std::vector<uint8_t>()};
}

// A walk with a photo every `step_m`, the view swinging a little.
inline std::vector<Stand> Walk(double from_m, double step_m, int count) {
  std::vector<Stand> stands;
  for (int i = 0; i < count; ++i)
    stands.push_back({from_m + i * step_m, std::round(90 + 15 * std::cos(M_PI * i / 3))});
  return stands;
}

// A database in a folder of its own.
class City {
 public:
  explicit City(EngineOptions options = Options(2)) : options_(std::move(options)) {
    options_.database.create = true;
    Open();
    options_.database.create = false;
    if (engine_ != nullptr) {
      EXPECT_OK(engine_->AddCamera("street", StreetCameraModel(), "the truth"));
    }
  }

  static EngineOptions Options(uint32_t thread_count) {
    EngineOptions options;
    options.thread_count = thread_count;
    options.database.block_cache_bytes = 16 << 20;
    options.database.sync_wal = false;  // what is tested needs no disk to be slow
    return options;
  }

  Engine& engine() { return *engine_; }
  const EngineOptions& options() const { return options_; }
  Queries Ask() const { return engine_->Ask(); }
  std::string path() const { return folder_ / "db"; }

  void Close() { engine_.reset(); }
  void Open() {
    Close();
    auto opened = Engine::Open(path(), options_);
    EXPECT_OK(opened);
    if (opened.ok()) engine_ = std::move(*opened);
  }
  void Reopen() { Open(); }

  PhotoSubmission Submit(const std::string& name, std::vector<uint8_t> bytes) {
    return {{name, name, std::move(bytes)}, "street", "anna"};
  }
  PhotoSubmission Submit(const Stand& stand) {
    const TakenPhoto& photo = TakePhoto(stand);
    return Submit(photo.name, photo.jpeg);
  }

  Status TryAdd(const std::vector<PhotoSubmission>& photos, std::vector<AddOutcome>* outcomes) {
    return engine_->AddPhotos(photos,
                              [&](const AddOutcome& outcome) { outcomes->push_back(outcome); });
  }
  std::vector<AddOutcome> Add(const std::vector<PhotoSubmission>& photos) {
    std::vector<AddOutcome> outcomes;
    EXPECT_OK(TryAdd(photos, &outcomes));
    EXPECT_EQ(outcomes.size(), photos.size());
    outcomes.resize(photos.size());
    return outcomes;
  }
  std::vector<AddOutcome> Add(const std::vector<Stand>& stands) {
    std::vector<PhotoSubmission> photos;
    for (const Stand& stand : stands) photos.push_back(Submit(stand));
    return Add(photos);
  }
  AddOutcome AddOne(const std::string& name, std::vector<uint8_t> bytes) {
    return Add({Submit(name, std::move(bytes))}).front();
  }

  std::string Digest() const {
    const auto digest = DigestOf(Ask().snapshot());
    EXPECT_OK(digest);
    return digest.ok() ? digest->Hex() : "";
  }
  CityStatus Counts() const {
    auto status = Ask().Status();
    EXPECT_OK(status);
    return status.ok() ? *status : CityStatus();
  }

 private:
  TemporaryFolder folder_;
  EngineOptions options_;
  std::unique_ptr<Engine> engine_;
};

// For a message: what became of each photo.
inline std::string Told(const std::vector<AddOutcome>& outcomes) {
  std::string text;
  for (const AddOutcome& o : outcomes) {
    text += std::string(o.duplicate ? "duplicate" : VerdictText(o.verdict)) + " " + o.name + ": " +
            ReasonText(o.reason) + ": " + o.detail + "\n";
  }
  return text;
}

inline testing::AssertionResult IsSound(const Snapshot& snapshot) {
  const auto violations = FindViolations(snapshot, 20);
  if (!violations.ok()) return testing::AssertionFailure() << violations.status().message();
  if (violations->empty()) return testing::AssertionSuccess();
  testing::AssertionResult failure = testing::AssertionFailure();
  for (const std::string& violation : *violations) failure << violation << "\n";
  return failure;
}

// How the poses of one reconstruction differ from the truth after the best similarity.
struct PoseErrors {
  size_t count = 0;
  double center_m_median = 0, center_m_max = 0, angle_deg_median = 0, angle_deg_max = 0;
};

inline PoseErrors CompareWithTruth(const Snapshot& snapshot, ReconstructionId reconstruction,
                                   const std::vector<Stand>& stands) {
  std::vector<Rigid3> found, truth;
  for (const Stand& stand : stands) {
    const TakenPhoto& photo = TakePhoto(stand);
    const auto id = snapshot.FindImageByName(photo.name);
    if (!id.ok() || !*id) continue;
    const auto pose = snapshot.FindPose(**id);
    if (!pose.ok() || !*pose || (*pose)->reconstruction != reconstruction) continue;
    found.push_back((*pose)->cam_from_world);
    truth.push_back(photo.cam_from_world);
  }
  PoseErrors errors;
  errors.count = found.size();
  if (found.size() < 3) return errors;
  Eigen::Matrix3Xd from(3, found.size()), to(3, found.size());
  for (size_t i = 0; i < found.size(); ++i) {
    from.col(static_cast<Eigen::Index>(i)) = found[i].Center();
    to.col(static_cast<Eigen::Index>(i)) = truth[i].Center();
  }
  // Centres on a line leave a turn about it open; a second point a camera, a metre ahead of it in
  // the truth's scale, does not. The scale comes from a first fit.
  const double scale = std::cbrt(Eigen::umeyama(from, to).topLeftCorner<3, 3>().determinant());
  Eigen::Matrix3Xd from_all(3, 2 * found.size()), to_all(3, 2 * found.size());
  for (size_t i = 0; i < found.size(); ++i) {
    const Eigen::Index k = 2 * static_cast<Eigen::Index>(i);
    from_all.col(k) = found[i].Center();
    to_all.col(k) = truth[i].Center();
    from_all.col(k + 1) = found[i].Inverse() * Eigen::Vector3d(0, 0, 1 / scale);
    to_all.col(k + 1) = truth[i].Inverse() * Eigen::Vector3d(0, 0, 1);
  }
  const Eigen::Matrix4d fit = Eigen::umeyama(from_all, to_all);
  const Eigen::Matrix3d turn =
      fit.topLeftCorner<3, 3>() / std::cbrt(fit.topLeftCorner<3, 3>().determinant());
  std::vector<double> centers_m, angles_deg;
  for (size_t i = 0; i < found.size(); ++i) {
    centers_m.push_back((fit.topLeftCorner<3, 3>() * found[i].Center() +
                         fit.topRightCorner<3, 1>() - truth[i].Center())
                            .norm());
    const Eigen::Quaterniond rotation = found[i].rotation * Eigen::Quaterniond(turn).conjugate();
    angles_deg.push_back(rotation.angularDistance(truth[i].rotation) * 180 / M_PI);
  }
  const auto middle = static_cast<std::ptrdiff_t>(found.size() / 2);
  std::sort(centers_m.begin(), centers_m.end());
  std::sort(angles_deg.begin(), angles_deg.end());
  errors.center_m_median = centers_m[static_cast<size_t>(middle)];
  errors.center_m_max = centers_m.back();
  errors.angle_deg_median = angles_deg[static_cast<size_t>(middle)];
  errors.angle_deg_max = angles_deg.back();
  return errors;
}

}  // namespace veduta
