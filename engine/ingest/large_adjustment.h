// SPDX-License-Identifier: Apache-2.0
#pragma once
// The adjustment of a whole reconstruction that takes long, without keeping others from writing: it
// is computed from a snapshot, in a map of its own, and needs a turn of the writer for its commit
// alone. Where nothing has changed the reconstruction meanwhile, as where a list waits for
// what follows from its photos, the result is that of AdjustWhole or RelaxReconstruction in a turn,
// to the last bit. Otherwise it is carried over (carrying_over.h).

#include <memory>
#include <optional>

#include "engine/ingest/carrying_over.h"
#include "engine/ingest/follow_up_steps.h"
#include "engine/ingest/ingest_parts.h"
#include "engine/ingest/lens_refinement.h"
#include "engine/ingest/relaxation_steps.h"

namespace veduta {

// One thread at a time.
class LargeAdjustment final {
 public:
  // What `parts` points to must outlive it; its map is not used.
  LargeAdjustment(const IngestParts& parts, ReconstructionId reconstruction);

  // Adjusts, or relaxes what is too large for that. Reads the snapshot of this moment and writes
  // nothing. Takes time and memory for each image; wants no turn.
  Status Compute();

  // Commits what was computed, once, for who has the writer's turn; `map` is the one that others
  // share, and holds nothing that this has changed afterwards. Nothing is committed where the
  // reconstruction is gone, or where it was to be relaxed and is due anew (IsDueAnew). After an
  // error nothing is visible and the map may be half changed: the caller clears it.
  Result<AdjustedWhole> Commit(CityMap* map);

 private:
  IngestParts PartsWith(CityMap* map) const;

  const IngestParts parts_;
  const ReconstructionId reconstruction_;
  bool is_relaxed_ = false;
  FoundAdjustment found_;  // otherwise
  // The same with refined lenses, where that is due: taken where nothing has changed meanwhile, the
  // lenses that were refined included, which another reconstruction may have, too.
  struct WithLenses {
    LensesOfImages before;
    CityMap map;
    Healing healing;
  };
  std::optional<WithLenses> with_lenses_;
  FoundRelaxation relaxation_;  // where it is relaxed
};

}  // namespace veduta
