// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which work follows from the photos that are stored. It is read from the database's state and
// never remembered, so that a process goes on where a killed one stopped.

#include <optional>
#include <set>
#include <utility>

#include "engine/door/submission.h"
#include "engine/ingest/ingest_options.h"
#include "engine/retrieval/retrieval.h"
#include "storage/database.h"

namespace veduta {

// One step that is due.
struct DueStep {
  FollowUpKind kind = FollowUpKind::kPropagation;
  ImageId image;  // kPropagation: the photo to try again
  // kAdjustment: the one to adjust; kGeoreference: the one to look for; kJudgment: the first of two
  ReconstructionId reconstruction;
  ReconstructionId other = {};  // kJudgment: the second
  SubmapId submap = {};         // kAdjustment: the submap to adjust; none: the whole
  // Whether it is computed without a turn of the writer, while others write: a vocabulary, and the
  // whole of a reconstruction that is larger than a group of submaps (large_adjustment.h).
  bool is_long = false;
};

// Steps that have failed and are passed over.
class StepsSetAside final {
 public:
  void Add(const DueStep& step);
  bool Contains(const DueStep& step) const;

 private:
  std::set<ImageId> propagations_;
  std::set<std::pair<ReconstructionId, SubmapId>> adjustments_;
  std::set<std::pair<ReconstructionId, ReconstructionId>> judgments_;
  std::set<ReconstructionId> georeferences_;
  bool vocabulary_ = false;
};

// A reconstruction is due when it has grown enough since all of it was last adjusted, or was merged
// with another since. One that is merged away never is. One that has submaps is due when it has
// grown by a larger share; then it is adjusted as a whole or relaxed (IsRelaxed).
bool IsAdjustmentDue(const ReconstructionRecord& record, bool is_parted,
                     const AdjustmentSchedule& schedule);

// Whether a reconstruction that is due is relaxed by its submaps (relaxation_steps.h), because it
// is too large to be adjusted as a whole.
bool IsRelaxed(const ReconstructionRecord& record, bool is_parted,
               const AdjustmentSchedule& schedule);

// Whether adjustments leave borders of its submaps (submap_borders.h): since that of the whole
// which may be the last one before it is relaxed.
bool KeepsBorders(const ReconstructionRecord& record, bool is_parted,
                  const AdjustmentSchedule& schedule);

// The next step that is due, or none: photos to be tried again come first, oldest first (R16); then
// the adjustment of reconstructions, in ascending ids, the whole or its submaps (R18); then new
// judgments of merges, in ascending ids; then looks for the place of reconstructions on the earth;
// then a new vocabulary. Reads the state and, where no photo
// waits, the records of all reconstructions, submaps and hypotheses: O(their number + images in
// submaps). While a long step is `at_work` it passes over that one, other long ones, and all
// adjustments of its reconstruction, which would be done twice.
Result<std::optional<DueStep>> FindDueStep(const Snapshot& snapshot,
                                           const AdjustmentSchedule& schedule,
                                           const Retrieval& retrieval,
                                           const StepsSetAside& set_aside,
                                           const std::optional<DueStep>& at_work = {});

// A long step that is due, whatever else is, or none: a new vocabulary comes first, because all
// later photos are found by it. One of a reconstruction waits until the motions of its submaps are
// carried out. O(as FindDueStep).
Result<std::optional<DueStep>> FindLongStep(const Snapshot& snapshot,
                                            const AdjustmentSchedule& schedule,
                                            const Retrieval& retrieval,
                                            const StepsSetAside& set_aside);

}  // namespace veduta
