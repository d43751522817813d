// SPDX-License-Identifier: Apache-2.0
#pragma once
// An adjustment of a whole reconstruction that was computed while photos went on. What came
// meanwhile is not in it, so its poses and points cannot simply be written: each submap is moved as
// the adjustment has moved its images, with all that has come to it, and the submaps that this does
// not bring to where the adjustment would have them are adjusted by steps of their own. A
// reconstruction that has no submaps yet gets them here, before its size asks for them.

#include <map>
#include <set>
#include <utility>
#include <vector>

#include "engine/ingest/follow_up_steps.h"
#include "engine/ingest/ingest_parts.h"
#include "engine/ingest/write_scope.h"

namespace veduta {

// A camera where it is, and how far from it points are that it sees.
struct SeeingCamera {
  Rigid3 cam_from_world;
  double focal_px = 0;
  std::vector<std::pair<PointId, double>> depths;
};

// The images in the map that are in the reconstruction, with a hundred points of each at most.
std::map<ImageId, SeeingCamera> ListCameras(const CityMap& map, ReconstructionId reconstruction);

// What the adjustment of a whole reconstruction has found.
struct FoundAdjustment {
  ReconstructionRecord record;             // as it was when it was read
  std::set<ImageId> images;                // of the reconstruction then
  std::vector<ForbiddenRecord> forbidden;  // then, of pairs of these images
  std::map<ImageId, SeeingCamera> before;  // likewise
  CityMap map;                             // as it is adjusted
  Healing healing;
};

// Notes what is forbidden of the images of `found`.
Status NoteForbidden(const Snapshot& snapshot, FoundAdjustment* found);

// Whether somebody has forbidden or allowed a pair of these images since, or the reconstruction was
// made due in another way: its adjustment is due again then, whatever was found.
Result<bool> IsDueAnew(const FoundAdjustment& found, const ReconstructionRecord& now,
                       const Snapshot& snapshot);

// Brings that to the reconstruction as it is now, and commits: images lose their poses and parts
// are split off as far as they are still there (TakeOutOfRegion); submaps receive the motions that
// best carry their cameras from where they are now, of least squares over the cameras' centres and
// points before them; those without such a camera move with others (SpreadMotions). A submap is due
// where its motion leaves one of its cameras off by a quarter of a pixel, or takes it as far from
// where the motion of a submap beside it would. After an error nothing is visible and the map may
// be half changed: the caller clears it. O(cameras and pairs of the reconstruction, and what the
// cameras see that have moved meanwhile).
Result<AdjustedWhole> CarryOver(const IngestParts& parts, const FoundAdjustment& found,
                                WriteScope scope);

}  // namespace veduta
