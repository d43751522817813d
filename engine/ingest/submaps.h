// SPDX-License-Identifier: Apache-2.0
#pragma once
// Keeps the stored submaps in step with what the steps of ingest do, and says which are due.
//
// A reconstruction of more than `whole_images_max` images, or a smaller one that others have
// changed while all of it was adjusted (carrying_over.h), is parted into submaps, and from then on
// each of them is adjusted together with those beside it, with what is around them held: what an
// adjustment costs does not grow with the city. A photo joins the submap of the image that it
// shares most points with. A small part that is merged joins one, too; a larger one becomes a
// submap of its own, and what lies at the seam is due.

#include <map>
#include <optional>
#include <set>
#include <unordered_map>
#include <vector>

#include "engine/ingest/ingest_options.h"
#include "engine/ingest/placement.h"
#include "engine/mapping/city_map.h"
#include "storage/database.h"

namespace veduta {

// The submaps as they were stored, and what a step makes of them.
class Submaps final {
 public:
  // O(images in submaps).
  static Result<Submaps> Read(const Snapshot& snapshot);

  bool IsParted(ReconstructionId reconstruction) const;
  // The submap of this id, and the one that holds the image; null where there is none.
  const SubmapRecord* Find(SubmapId id) const;
  const SubmapRecord* FindOf(ImageId image) const;
  // All submaps of the reconstruction, ascending; and those of them that have a motion to carry
  // out.
  std::vector<SubmapId> List(ReconstructionId reconstruction) const;
  std::vector<SubmapId> ListMoving(ReconstructionId reconstruction) const;
  // The submaps of the reconstruction that are due, ascending.
  std::vector<SubmapId> ListDue(ReconstructionId reconstruction,
                                const AdjustmentSchedule& schedule) const;

  // Follows what has changed in the map: images that lost their pose, or are in another
  // reconstruction now, and new ones. `base` is what the map was loaded from; images that are new
  // must have the blocks of their points loaded.
  Status Follow(const CityMap& map, const Snapshot& base);
  // Does what Follow does, and makes due what a placement asks for: the submap of a photo that
  // raises doubt, and the submaps at the seam of a merge.
  Status FollowPlacement(const CityMap& map, const Snapshot& base, const Placement& placement);
  // The submap of each of these images is due; others are passed over.
  void MakeDue(std::span<const ImageId> images);
  // The whole reconstruction has just been adjusted at once: none of its submaps is due, and their
  // stored borders and motions are dropped, for they tell of the map before.
  void NoteAdjusted(ReconstructionId reconstruction);
  // This submap has just been adjusted: it is not due.
  void NoteAdjusted(SubmapId id);
  // Where a relaxation wants the submap to be moved; std::nullopt: it stays where it is.
  void SetMotion(SubmapId id, const std::optional<Sim3>& motion);
  // Replaces the images' submaps; all parts are due. The images are all of a reconstruction that
  // has none, or all of one submap.
  void Part(ReconstructionId reconstruction, std::span<const std::vector<ImageId>> parts);
  // The images of `from` join `into`, which is due; both are of one reconstruction.
  void Join(SubmapId from, SubmapId into);

  // Writes what has changed.
  void Write(Transaction* transaction) const;

 private:
  // Those without images as well.
  const std::set<SubmapId>& AllOf(ReconstructionId reconstruction) const;
  SubmapRecord* MutableOf(ImageId image);
  SubmapRecord& Add(SubmapRecord record);
  SubmapRecord& Make(ReconstructionId reconstruction, std::vector<ImageId> images);
  void Erase(ImageId image);
  void Insert(SubmapId id, ImageId image);
  void MoveAway(SubmapId from, ReconstructionId into, std::span<const ImageId> images);
  // The images that find a submap join it; returns the others.
  std::vector<ImageId> JoinNearest(const CityMap& map, std::vector<ImageId> images);

  std::map<SubmapId, SubmapRecord> records_;  // those without images are to be deleted
  std::unordered_map<ImageId, SubmapId> submap_of_;
  std::map<ReconstructionId, std::set<SubmapId>> submaps_of_;
  std::set<SubmapId> changed_;
  std::set<SubmapId> without_border_;  // whose stored borders tell of what is gone
};

}  // namespace veduta
