// SPDX-License-Identifier: Apache-2.0
#pragma once
// Adds some photos to a new database, localises others in it, and adds these at last.

#include <map>
#include <span>
#include <string>
#include <vector>

#include "engine/engine.h"
#include "storage/base/transform.h"
#include "tools/bench/orders/order_list.h"

namespace veduta::localization {

struct Pose {
  uint32_t reconstruction = 0;
  Rigid3 cam_from_world;
};

using Poses = std::map<std::string, Pose>;  // by the photo's name

struct LocalizationRun {
  std::vector<LocalizedPhoto> asked;  // in the order of the request
  double focal_px = 0;                // the right one of all photos
  double seconds = 0;                 // wall clock of localising all of them
  Poses before;                       // of the photos that were added, when the others were asked
  Poses after;                        // of all photos, when the others were added, too
};

Pose ToPose(ReconstructionId reconstruction, const PlainPose& pose);

// All photos were taken by one camera. Where `is_unknown`, it is not named when the photos are
// localised. The database lies in `folder`. kCorruption where localising
// has changed the digest of the database.
Result<LocalizationRun> RunLocalization(std::span<const orders::OrderedPhoto> added,
                                        std::span<const orders::OrderedPhoto> asked,
                                        const CameraModel& camera, bool is_unknown,
                                        uint32_t threads, const std::string& folder);

}  // namespace veduta::localization
