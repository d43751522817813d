// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where one photo was taken, by one state of the city, which it does not change.

#include <memory>
#include <vector>

#include "engine/door/answers.h"
#include "engine/ingest/ingest_options.h"
#include "engine/photo/image_features.h"
#include "engine/photo/photo_preparer.h"
#include "engine/query/unsure_poses.h"
#include "engine/retrieval/retrieval.h"
#include "storage/base/thread_pool.h"
#include "storage/database.h"

namespace veduta {

// What localising works with. All of it outlives the call.
struct LocalizationParts {
  std::shared_ptr<const Snapshot> snapshot;
  Retrieval* retrieval;
  ImageFeatureCache* features;
  ThreadPool* pool;
  const IngestOptions& options;
  UnsureCache* unsure = nullptr;   // may be null
  std::vector<ImageId> near = {};  // images near which the photo was taken: they are tried first
};

// Whether the lens is known, or was estimated from this photo and is refined with its pose.
enum class Lens : uint8_t { kKnown, kEstimated };

// Seeks the photo's neighbours and its pose as adding it would, and refuses a pose for the same
// reasons. What follows differs: nothing is founded or merged, and the poses of the city are held
// where they are while the photo's own is refined, with the points that it sees. One that may stand
// at another place that looks alike, too, is refused as kAmbiguous (misplaced.h), as is one where
// most images that share points with it may stand elsewhere in their own reconstruction
// (ListUnsure). A photo whose bytes are stored has the pose that is stored; if there is none, it is
// localised without itself. kNoMemory where the memory is too short, kCorruption where something
// stored that it needs is damaged. An estimated camera is answered as it is after the refinement,
// in which a focal length that the photo tells (> 0) has a say where it is not far off; the pose is
// refused where what is seen leaves the focal length open, whatever is told. Deterministic in the
// photo and the snapshot. Thread-safe. It loads the surroundings of the photo's neighbours anew
// each time.
Result<LocalizedPhoto> LocalizePhoto(const LocalizationParts& parts, PreparedPhoto photo,
                                     const CameraModel& camera, Lens lens = Lens::kKnown,
                                     double told_focal_px = 0);

}  // namespace veduta
