// SPDX-License-Identifier: Apache-2.0
#pragma once
// Keeps the stored hypotheses in step with what the steps of ingest do: merges that are proposed
// and not believed yet (storage/model/hypothesis.h), and merges that were taken back.
//
// A photo whose own search for a merge leads to one judges it, unless its seam is large, which
// takes long, or many pairs refute it and few agree, or the two were split there and not judged
// since, which might never end. It becomes due, and is judged by a step of its own
// (engine/ingest/judging.h), when what it rests on has changed:
//   - such a search finds a quarter more verified pairs across such a seam than when it was judged
//     last;
//   - the pictures lack something, and it is new or photos have judged it a few times: an image may
//     stand on its wrong side;
//   - a photo got a pose that shares points or a verified pair with an image at the seam, unless
//     the two were split there and not judged since;
//   - one of its two reconstructions was adjusted as a whole, or took in another one, or a submap
//     at the seam was adjusted, unless the two were split there and the reconstruction has not
//     grown by a share for which it is adjusted since;
//   - one of the two was merged into a third, to which the hypothesis went over;
//   - a quarter more images have come to speak for a loop that may close at it (seam_loop.h), or a
//     merge has changed that loop;
//   - somebody has forbidden a pair across.
// One that is open says nothing by itself, and becomes due by a merge or a loop alone.
// Where nothing of this happens, no photo costs anything. A judgment costs what the search of one
// photo for a merge costs.
//
// All functions read what is stored in `base`, the state that the transaction began with, and write
// into the transaction. O(hypotheses), and a few reads for those that change.

#include <span>

#include "engine/ingest/placement.h"
#include "storage/database.h"

namespace veduta {

// The hypothesis as it is once one of its two, `merge.from`, has become part of `into`, which is
// not the other one. Nothing changes where it is not of `merge.from`.
void GoOver(const Merge& merge, ReconstructionId into, HypothesisRecord* hypothesis);

// Stores what the placement has judged: refused merges with their votes, anew where they were known
// (the first time with an entry of the journal); those that were made, or that people forbid by
// now, are deleted; those of a reconstruction that was merged away go over. Those that the
// placement touches and has not judged become due.
Status WriteHypotheses(const Snapshot& base, const Placement& placement, DatabaseState* state,
                       Transaction* transaction);

// Stores a hypothesis about two reconstructions that no stored one is about, with the time of now
// and an entry of the journal.
void PutNewHypothesis(HypothesisRecord hypothesis, DatabaseState* state, Transaction* transaction);

// Whether hypotheses that a split has left are meant as well: with nothing new, their merge might
// be made and split again for ever.
enum class Splits { kMeant, kPassedOver };
// Has all hypotheses about this reconstruction judged anew; where images are given (ascending),
// only those that have one of these images at the seam.
Status MakeHypothesesDue(const Snapshot& base, ReconstructionId reconstruction,
                         std::span<const ImageId> images, Splits splits, Transaction* transaction);
// Has the hypothesis that these two, in either order, are one judged anew, where there is one.
Status MakeHypothesisDue(const Snapshot& base, ReconstructionId a, ReconstructionId b,
                         Transaction* transaction);
// Deletes all hypotheses about this reconstruction: it was dissolved, or is not what it was.
Status DropHypotheses(const Snapshot& base, ReconstructionId reconstruction,
                      Transaction* transaction);
// The image is removed: no hypothesis names it any more, and one that named no other is deleted.
Status ForgetInHypotheses(const Snapshot& base, ImageId image, Transaction* transaction);

}  // namespace veduta
