// SPDX-License-Identifier: Apache-2.0
#pragma once
// Believes a seam because a loop of seams closes there. At the corner of a street one photo may see
// both sides; what stands on one photo is not believed, for a repeated facade looks the same. But
// where the other seams of a loop say where the two sides are, and this one agrees, all of them are
// right: a wrong one would be off by how far apart the two lookalike places are.

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/ingest/mapping_context.h"
#include "storage/model/hypothesis.h"

namespace veduta {

// The seam that is asked for: images of `own` at the seam, ascending, at least one.
struct OpenSeam {
  ReconstructionId own, other;
  std::span<const ImageId> near;
  // A similarity that was refuted. The pairs that it explains show lookalike places or come from
  // images that stand on the wrong side, and are not asked: the others may say another one.
  std::optional<Sim3> refuted_own_from_other = {};
};

// A reconstruction of a loop, in the frame of the one that was asked from.
struct LoopPart {
  ReconstructionId id;
  Sim3 own_from_part;
};

// Where two parts of a loop meet: images of `a` there, ascending, at least one.
struct LoopSeam {
  ReconstructionId a, b;
  std::vector<ImageId> near;
};

struct ClosedLoop {
  std::vector<LoopPart> parts;  // `other` first; without `own`
  std::vector<LoopSeam> seams;
  std::string evidence;  // for a person
};

// How exactly a similarity by views must be known where a loop may confirm it.
ViewAlignmentOptions LooseAlignment(const MapperOptions& options);

// Whether a loop may confirm a similarity that is refused for this: nothing speaks against it, and
// too little for it.
bool MayCloseLoop(RefusalReason reason);

// Whether a loop may close at the seam of a hypothesis: over its similarity or, where that one is
// refuted, by pairs that contradict it.
bool MayCloseLoop(const HypothesisRecord& hypothesis);

// The ways between reconstructions over seams whose similarity is known and of which MayCloseLoop
// is true. O(hypotheses) to make. `all` must outlive it.
class Detours final {
 public:
  explicit Detours(std::span<const HypothesisRecord> all);
  // The shortest way from `own` to `other` but for their own seam; of two as long, that over lower
  // ids. Empty where there is none of five seams or fewer. O(seams that five lead to).
  std::vector<HypothesisRecord> Find(ReconstructionId own, ReconstructionId other) const;

 private:
  struct Step {
    ReconstructionId to;
    const HypothesisRecord* by;
  };
  std::map<ReconstructionId, std::vector<Step>> steps_;  // of each, in ascending ids
};

// How many images speak for a loop: those at the seam, and those at the seams of a detour.
size_t CountLoopImages(const HypothesisRecord& hypothesis,
                       std::span<const HypothesisRecord> detour);

// Whether a loop closes at the seam: by a second place where the two meet, or by a detour over
// other reconstructions. Nothing where what the rest of the loop says is too vague, differs from
// what is seen at the seam, or stands on what the seam itself stands on. Loads the images of all
// seams of the loop with their neighbourhoods. Deterministic in what is stored.
Result<std::optional<ClosedLoop>> CloseLoop(const MappingContext& context, const OpenSeam& open,
                                            std::span<const HypothesisRecord> detour);

}  // namespace veduta
