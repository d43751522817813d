// SPDX-License-Identifier: Apache-2.0
#pragma once
// Writes what an adjustment has taken out of a reconstruction (doubt.h): parts that are split off,
// and images that wait again.

#include <vector>

#include "engine/ingest/adjusted_whole.h"
#include "engine/ingest/doubt.h"
#include "engine/ingest/ingest_parts.h"
#include "engine/ingest/write_scope.h"
#include "storage/written_ahead.h"

namespace veduta {

class HealingWriter final {
 public:
  // All outlive it. `state` is the caller's to put into the transaction.
  HealingWriter(const IngestParts& parts, const WriteScope& scope, ReconstructionId from,
                DatabaseState* state)
      : parts_(parts), scope_(scope), from_(from), state_(*state) {}

  // Each part becomes a reconstruction of its own, in the frame that it had, whose points are
  // written ahead. What is forbidden to be merged with the whole is forbidden of the part, too.
  // Moves the images and blocks of the map.
  Status SplitOff(const Healing& healing);
  // A seam of the reconstruction with another one becomes one of each part that has an image there,
  // in whose frame nothing has changed. All are due. Comes after SplitOff.
  Status ShareSeams(const Healing& healing);
  // Each seam along which a part was split off becomes a hypothesis that its two sides are one,
  // with the votes of the verified pairs across it. It is due, so that its sides are weighed
  // (judging.h). Comes after SplitOff. Loads what is around the seams.
  Status ProposeSeams();
  // Images that lost their poses are tried again at once. One that was doubted before, since a
  // person last did something, waits for a neighbour: placing and doubting it would never end.
  Status Postpone(const Healing& healing);
  // Deletes what the dense pass has made of images that lost their poses or were split off, and of
  // those that have another focal length now.
  Status RemoveOutdatedDense(const Healing& healing, std::span<const ImageId> refined = {});

  const AdjustedWhole& adjusted() const { return adjusted_; }
  const std::vector<ReconstructionRecord>& split_off() const { return split_off_; }

 private:
  Status ForbidAsOfWhole(ReconstructionId part);
  Status ProposeSeam(MapLoader* loader, ReconstructionId own, ReconstructionId other);

  const IngestParts& parts_;
  const WriteScope& scope_;
  const ReconstructionId from_;
  DatabaseState& state_;
  AdjustedWhole adjusted_;
  std::vector<ReconstructionRecord> split_off_;
  std::vector<WrittenAhead> blocks_;  // kept until the commit
};

}  // namespace veduta
