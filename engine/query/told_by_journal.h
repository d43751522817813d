// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the journal says once more of things that nothing else determines: who contributed an image
// and why it is where it is, what a camera is called, when all of a reconstruction was last
// adjusted, how many images the vocabulary was made for. A later entry counts.

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "storage/model/image.h"
#include "storage/model/journal.h"
#include "storage/model/state.h"

namespace veduta {

struct ToldByJournal {
  struct Image {
    std::string contributor, detail;
    bool propagated = false;
  };
  std::map<ImageId, Image> images;
  std::set<ImageId> removed;  // images that were there and are not any more
  std::map<ReconstructionId, uint64_t> images_at_adjustment;
  std::set<std::string> cameras;  // names; one is told anew where its lens is refined
  std::optional<uint64_t> images_at_vocabulary;
  bool vocabulary_imported = false;

  void Take(const JournalRecord& entry);

  bool HasContributorOf(const ImageRecord& image) const;
  // Whether the image has its contributor and its reason.
  bool AgreesWith(const ImageRecord& image) const;
  // Whether the state has its vocabulary.
  bool AgreesWith(const DatabaseState& state) const;
  uint64_t ImagesAtAdjustment(ReconstructionId id) const;
};

}  // namespace veduta
