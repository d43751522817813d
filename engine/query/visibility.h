// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which photos and contributions may be told to whoever asks.

#include <functional>
#include <vector>

#include "engine/door/moderation.h"
#include "storage/database.h"

namespace veduta {

// Whether a curator has hidden the image, by itself or with its contribution. Two reads at most.
Result<bool> IsHidden(const Snapshot& snapshot, const ImageRecord& image);

// Thread-safe. Reads nothing where all is seen, and a few records for each image otherwise.
class Visibility final {
 public:
  // The snapshot must outlive it.
  Visibility(const Snapshot& snapshot, const Sight& sight) : snapshot_(snapshot), sight_(sight) {}

  Result<bool> Sees(const ImageRecord& image) const;
  // One that was removed is seen unless it was hidden before.
  Result<bool> Sees(ImageId image) const;
  Result<bool> SeesContribution(uint32_t number) const;
  // Where only a part of the photos is seen, those that one of these has a pose in are, and where
  // the part is a reconstruction, also those that it was merged through. O(photos of the
  // contribution) where one is the part.
  Result<bool> Sees(ReconstructionId reconstruction) const;

  // Takes out of the answers what must not be told; `id_of` says which image, or reconstruction, an
  // answer is about.
  template <typename Id, typename Answer>
  Status Keep(Id Answer::*id_of, std::vector<Answer>* answers) const {
    Status failure;
    if (SeesAll()) return failure;
    std::erase_if(*answers, [&](const Answer& answer) {
      const Result<bool> sees = Sees(answer.*id_of);
      if (!sees.ok()) failure = sees.status();
      return !sees.ok() || !*sees;
    });
    return failure;
  }

  // Whether all of the city is seen, but for what is hidden.
  bool SeesWhole() const { return sight_.contribution == 0 && !sight_.reconstruction.valid(); }
  bool SeesAll() const { return sight_.sees_hidden && SeesWhole(); }

 private:
  Result<bool> IsInScope(const ImageRecord& image) const;
  // Whether it is the reconstruction that is seen, what that was merged into, or between the two.
  Result<bool> IsOnTheWay(ReconstructionId reconstruction) const;

  const Snapshot& snapshot_;
  const Sight sight_;
};

}  // namespace veduta
