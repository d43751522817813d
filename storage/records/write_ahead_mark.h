// SPDX-License-Identifier: Apache-2.0
#pragma once
// Family `queue`: what was written ahead of its commit. The value is empty, or, of a photo, a key
// of `names` (image_record.h). FORMAT.md, section "write_ahead_mark".

#include <cstdint>
#include <string>
#include <string_view>

#include "storage/base/content_hash.h"
#include "storage/base/ids.h"
#include "storage/base/status.h"

namespace veduta {

// First byte of the key. Never renumbered.
enum class MarkKind : uint8_t {
  kPhoto = 1,        // content hash
  kPointBlocks = 2,  // reconstruction, generation
  kVocabulary = 3,   // generation
};

std::string PhotoMarkKey(const ContentHash& photo);
bool ParsePhotoMarkKey(std::string_view key, ContentHash* photo);  // false: another mark
std::string PointBlocksMarkKey(ReconstructionId reconstruction, uint32_t generation);
std::string VocabularyMarkKey(uint32_t generation);

// What a mark stands for. Only the fields of its kind are set.
struct WriteAheadMark {
  MarkKind kind = MarkKind::kPhoto;
  ContentHash photo;
  ReconstructionId reconstruction;
  uint32_t generation = 0;
};
// kCorruption where the key is no mark.
Status ParseMarkKey(std::string_view key, WriteAheadMark* mark);

}  // namespace veduta
