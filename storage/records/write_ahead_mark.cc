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

Status ParseMarkKey(std::string_view key, WriteAheadMark* mark) {
  if (key.empty()) return Status::Corruption("an empty mark");
  mark->kind = static_cast<MarkKind>(key[0]);
  std::string_view rest = key.substr(1);
  switch (mark->kind) {
    case MarkKind::kPhoto:
      if (ParsePhotoMarkKey(key, &mark->photo)) return Status::Ok();
      return Status::Corruption("a photo's mark without a content hash");
    case MarkKind::kPointBlocks:
      if (TakeBigEndian32(&rest, &mark->reconstruction.value) &&
          TakeBigEndian32(&rest, &mark->generation) && rest.empty())
        return Status::Ok();
      return Status::Corruption("a mark of points without reconstruction and generation");
    case MarkKind::kVocabulary:
      if (TakeBigEndian32(&rest, &mark->generation) && rest.empty()) return Status::Ok();
      return Status::Corruption("a mark of a vocabulary without its generation");
  }
  return Status::Corruption("a mark of unknown kind " +
                            std::to_string(static_cast<unsigned char>(key[0])));
}

}  // namespace veduta
