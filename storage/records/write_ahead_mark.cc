// SPDX-License-Identifier: Apache-2.0
#include "storage/records/write_ahead_mark.h"

#include "storage/records/key_bytes.h"
#include "storage/records/photo_record.h"

namespace veduta {
namespace {

std::string MarkKey(MarkKind kind, const std::string& rest) {
  return TaggedKey(static_cast<uint8_t>(kind), rest);
}

}  // namespace

std::string PhotoMarkKey(const ContentHash& photo) {
  return MarkKey(MarkKind::kPhoto, HashKey(photo));
}

bool ParsePhotoMarkKey(std::string_view key, ContentHash* photo) {
  if (key.empty() || key[0] != static_cast<char>(MarkKind::kPhoto)) return false;
  return ParseHashKey(key.substr(1), photo);
}

std::string PointBlocksMarkKey(ReconstructionId reconstruction, uint32_t generation) {
  return MarkKey(MarkKind::kPointBlocks, Key32x2(reconstruction.value, generation));
}

std::string VocabularyMarkKey(uint32_t generation) {
  return MarkKey(MarkKind::kVocabulary, Key32(generation));
}

}  // namespace veduta
