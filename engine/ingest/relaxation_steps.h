// SPDX-License-Identifier: Apache-2.0
#pragma once
// What holds the submaps of a large reconstruction together. Adjustments of submaps alone neither
// spread drift over a loop nor notice that a large part is wrong. So from time to time the whole is
// looked at as submaps and what lies between them: what each adjustment of one has left in its
// border (submap_borders.h). No image and no point is read for that.
//
// A relaxation moves every submap as a whole (submap_relaxation.h). It writes the motions into the
// submaps' records, and they are carried out group by group, each group by a step of its own; then
// the submaps whose borders have changed are adjusted. All of that is read from the records, so a
// killed process goes on.
// Each function that writes is one transaction. After an error nothing is committed and the map may
// be half changed: the caller clears it.

#include <map>
#include <set>
#include <string>
#include <vector>

#include "engine/ingest/follow_up_steps.h"
#include "engine/ingest/ingest_parts.h"
#include "engine/ingest/write_scope.h"

namespace veduta {

// What a look at the whole has found: one of the first three, or nothing.
struct FoundRelaxation {
  // Submaps that have no border yet, by one image of each.
  std::vector<ImageId> without_border;
  std::vector<ImageId> wrong_part;  // does not agree with the rest
  std::map<SubmapId, Sim3> motions;
  std::set<SubmapId> changed;  // whose borders change by the motions
  // A part does not agree with the rest as the submaps stood. What is far off for it has drifted
  // agrees once it was moved: it is judged then.
  bool is_to_judge = false;
  std::string how;           // for the journal
  uint32_t image_count = 0;  // of the reconstruction
};

// Judges the whole by what is known of the fragments of its submaps (agreeing_parts.h), by as many
// contradictions as a merge may have that its pictures confirm, for these are not asked here. Where
// they fall apart, and did so the last time too, or moving them would not help, names the largest
// part that does not agree with the rest. Otherwise relaxes the whole, where that is significant.
// The published frame stays: the motions are carried back by the
// similarity that best fits all cameras to where they were. Writes nothing. Thread-safe.
// Deterministic at any number of threads. O(submaps, their borders, and poses).
Result<FoundRelaxation> FindRelaxation(const Snapshot& base, ReconstructionId reconstruction,
                                       const DoubtOptions& options, ThreadPool* pool);

// Writes what was found, perhaps some commits ago: what is gone since is passed over. Submaps
// without a border are made due. A wrong part is split off, and the rest is due again; that loads
// the part. Motions are written into the submaps' records; submaps that have come since move with
// those beside them (SpreadMotions), and are due.
Result<AdjustedWhole> WriteRelaxation(const IngestParts& parts, ReconstructionId reconstruction,
                                      const FoundRelaxation& found, WriteScope scope);

// Both.
Result<AdjustedWhole> RelaxReconstruction(const IngestParts& parts, ReconstructionId reconstruction,
                                          WriteScope scope);

// Carries out the motions of a submap and of those around it that have one (FindGroup): moves their
// images and the points that they are home to. O(these submaps and what is around them).
Status MoveSubmaps(const IngestParts& parts, ReconstructionId reconstruction, SubmapId submap,
                   WriteScope scope);

}  // namespace veduta
