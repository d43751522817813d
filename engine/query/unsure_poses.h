// SPDX-License-Identifier: Apache-2.0
#pragma once
// Images whose pose nobody is told, because they may as well stand elsewhere.

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "storage/database.h"

namespace veduta {

using UnsureImages = std::map<ImageId, std::vector<ReconstructionId>>;

// Whether a merge that is refused for this shows two places that look alike, rather than one of
// which too little is known.
bool TellsPlacesApart(RefusalReason reason);

// Whether so few of a photo's neighbours with a pose stand beside it in its own reconstruction, and
// so many in others, that its pose is not told: it shows what is alike at many places.
bool IsMostlyElsewhere(size_t beside, size_t elsewhere);

// The images that stand at a seam of two places that look alike, on a side that is not sure
// (HypothesisRecord::unsure), each with the reconstructions on whose side it may stand as well,
// ascending. What they see holds their reconstruction together all the same, for it looks alike on
// either side.
//
// In a reconstruction with such a seam also the images that only unsure ones tie to the rest, and
// those that a strong verified pair ties to a place in the same reconstruction where they do not
// stand: whole rows of photos were at the wrong one of two twin facades, held there by a photo or
// two that nobody is told. There and in small reconstructions also the images most of whose
// neighbours stand in other reconstructions (IsMostlyElsewhere), and all images where most are
// unsure. And all images of a reconstruction that has refused half as many photos as it has: those
// may stand elsewhere in their own, which is what stands with them. O(hypotheses + poses + pairs of
// the images of small reconstructions), and where there is such a seam O(images of its
// reconstructions).
Result<UnsureImages> ListUnsure(const Snapshot& snapshot);

// The last answer of ListUnsure, for who asks again and again. Thread-safe; of those who ask at the
// same time one makes it, and the others wait.
class UnsureCache final {
 public:
  Result<std::shared_ptr<const UnsureImages>> Get(const Snapshot& snapshot);
  // Whether Get answers at once.
  bool IsCurrent(const Snapshot& snapshot);

 private:
  std::mutex making_;  // locked first
  std::mutex mutex_;
  std::string key_;        // what the answer rests on
  uint64_t sequence_ = 0;  // of the last snapshot that it was given for
  std::shared_ptr<const UnsureImages> answer_;
};

}  // namespace veduta
