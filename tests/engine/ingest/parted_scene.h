// SPDX-License-Identifier: Apache-2.0
#pragma once
// A reconstruction of twelve cameras in three submaps, and how far it is from the truth.

#include "engine/ingest/ingest_options.h"
#include "engine/mapping/similarity.h"
#include "tests/engine/ingest/scene_database.h"

namespace veduta {

inline constexpr ReconstructionId kCity(1);
inline constexpr SceneOptions kArc{.camera_count = 12, .point_count = 500, .arc_deg = 60};

// Submaps are small, and above seven images the whole is relaxed.
inline IngestOptions SmallParts() {
  IngestOptions options;
  options.schedule.whole_images_max = 7;
  options.schedule.submap_images_max = 6;
  options.schedule.submap_images_min = 2;
  options.schedule.region_images_max = 6;
  options.schedule.whole_again_images_max = 0;
  return options;
}

// Twelve cameras as three submaps of four, which were adjusted; the whole is due. Those from
// `placed` on have no pose.
inline void AddArc(SceneDatabase* scene, uint32_t placed = 12) {
  scene->LimitTracks(3);
  scene->AddImages(0, 12);
  std::vector<uint32_t> cameras(placed);
  for (uint32_t k = 0; k < placed; ++k) cameras[k] = k;
  ASSERT_EQ(scene->AddReconstruction(cameras), kCity);
  const auto transaction = scene->database()->BeginTransaction();
  ReconstructionRecord record = *scene->Snap()->GetReconstruction(kCity);
  record.images_at_adjustment = 0;
  transaction->PutReconstruction(record);
  for (uint32_t s = 0; s < 3; ++s) {
    std::vector<ImageId> images;
    for (uint32_t k = 4 * s; k < std::min(4 * s + 4, placed); ++k) images.push_back(ImageId(k + 1));
    const auto count = static_cast<uint32_t>(images.size());
    transaction->PutSubmap({SubmapId(s + 1), kCity, images, count});
  }
  ASSERT_OK(transaction->Commit());
}

// Wants the last submap moved.
inline const Sim3 kDrift{1.02,
                         Eigen::Quaterniond(Eigen::AngleAxisd(0.01, Eigen::Vector3d(0, 1, 0))),
                         Eigen::Vector3d(0.05, -0.02, 0.03)};

inline void SetDrift(SceneDatabase* scene) {
  const auto transaction = scene->database()->BeginTransaction();
  SubmapRecord last = scene->Snap()->ListSubmaps()->back();
  last.motion = kDrift;
  transaction->PutSubmap(last);
  ASSERT_OK(transaction->Commit());
}

// The largest distance of a camera from the truth, after the similarity that fits all best.
inline double WorstCenter(const SceneDatabase& scene) {
  std::vector<Rigid3> truth, now;
  for (uint32_t k = 0; k < 12; ++k) {
    const auto pose = *scene.Snap()->FindPose(ImageId(k + 1));
    if (!pose) continue;
    truth.push_back(scene.scene().poses[k]);
    now.push_back(pose->cam_from_world);
  }
  const auto truth_from_now = FitCameras(now, truth);
  double worst = 0;
  for (size_t i = 0; i < now.size(); ++i)
    worst = std::max(worst, (*truth_from_now * now[i].Center() - truth[i].Center()).norm());
  return worst;
}

}  // namespace veduta
