// SPDX-License-Identifier: Apache-2.0
#include "engine/query/stored_records.h"

#include "storage/records/camera_record.h"
#include "storage/records/image_record.h"
#include "storage/records/journal_record.h"
#include "storage/records/key_bytes.h"
#include "storage/records/pair_record.h"
#include "storage/records/photo_record.h"
#include "storage/records/point_block.h"
#include "storage/records/pose_record.h"
#include "storage/records/reconstruction_record.h"
#include "storage/records/vocabulary_record.h"

namespace veduta {
namespace {

template <typename Record, typename Id>
Status ReadById(std::string_view key, std::string_view value, Id id, Record* record) {
  VEDUTA_RETURN_IF_ERROR(ParseId(key, &id.value));
  return Decode(value, id, record);
}

Status ReadImageNumber(std::string_view value, ImageId* image) {
  if (value.size() != sizeof(image->value))
    return Status::Corruption("a number of " + std::to_string(value.size()) + " bytes");
  std::vector<ImageId> images;
  VEDUTA_RETURN_IF_ERROR(DecodeImages(value, &images));
  *image = images.front();
  return Status::Ok();
}

Status ReadHash(std::string_view key, ContentHash* hash) {
  return ParseHashKey(key, hash) ? Status::Ok() : Status::Corruption("a key of wrong length");
}

// Generation and number, which is a word or an image.
Status ReadGeneration(std::string_view key, uint32_t* generation, uint32_t* number) {
  if (TakeBigEndian32(&key, generation) && TakeBigEndian32(&key, number) && key.empty())
    return Status::Ok();
  return Status::Corruption("a key of wrong length");
}

}  // namespace

std::string PlaceOf(Family family, std::string_view key) {
  return std::string("family ") + FamilyName(family) + ", key " + KeyText(key);
}

Status ReadStored(std::string_view key, std::string_view value, CameraRecord* camera) {
  return ReadById(key, value, CameraId(), camera);
}

Status ReadStored(std::string_view key, std::string_view value, NameEntry* entry) {
  if (!ParseNameKey(key, &entry->name)) return Status::Corruption("no name and contributor");
  return ReadImageNumber(value, &entry->image);
}

Status ReadStored(std::string_view key, std::string_view value, HashEntry* entry) {
  VEDUTA_RETURN_IF_ERROR(ReadHash(key, &entry->photo));
  return ReadImageNumber(value, &entry->image);
}

Status ReadStored(std::string_view key, std::string_view value, FeaturesEntry* entry) {
  VEDUTA_RETURN_IF_ERROR(ReadHash(key, &entry->photo));
  return Decode(value, &entry->features);
}

Status ReadStored(std::string_view key, std::string_view value, ImageRecord* image) {
  return ReadById(key, value, ImageId(), image);
}

Status ReadStored(std::string_view key, std::string_view value, PairRow* row) {
  const std::string_view tag = key.substr(0, 1);
  std::string_view rest = key.substr(tag.size());
  ImageId other;
  if (!TakeBigEndian32(&rest, &row->image.value) || !TakeBigEndian32(&rest, &other.value) ||
      !rest.empty())
    return Status::Corruption("a key of wrong length");
  if (!row->image.valid() || !other.valid()) return Status::Corruption("a key with id 0");
  switch (static_cast<PairEntry>(tag[0])) {
    case PairEntry::kNeighbor:
      row->is_neighbor = true;
      return Decode(value, other, &row->neighbor);
    case PairEntry::kRecord:
      row->is_neighbor = false;
      return Decode(value, row->image, other, &row->pair);
  }
  return Status::Corruption("a key of an unknown kind");
}

Status ReadStored(std::string_view key, std::string_view value, ReconstructionRecord* record) {
  return ReadById(key, value, ReconstructionId(), record);
}

Status ReadStored(std::string_view key, std::string_view value, PoseRecord* pose) {
  return ReadById(key, value, ImageId(), pose);
}

Status ReadStored(std::string_view key, std::string_view value, ObservationsEntry* entry) {
  VEDUTA_RETURN_IF_ERROR(ParseId(key, &entry->image.value));
  return Decode(value, &entry->observations);
}

Status ReadStored(std::string_view key, std::string_view value, PointsEntry* entry) {
  ImageId home;
  if (!TakeBigEndian32(&key, &entry->reconstruction.value) ||
      !TakeBigEndian32(&key, &entry->generation) || !TakeBigEndian32(&key, &home.value) ||
      !key.empty())
    return Status::Corruption("a key of wrong length");
  return Decode(value, home, &entry->block);
}

Status ReadStored(std::string_view key, std::string_view value, WordsEntry* entry) {
  VEDUTA_RETURN_IF_ERROR(ReadGeneration(key, &entry->generation, &entry->image.value));
  return DecodeWords(value, &entry->words);
}

Status ReadStored(std::string_view key, std::string_view value, PostingsEntry* entry) {
  VEDUTA_RETURN_IF_ERROR(ReadGeneration(key, &entry->generation, &entry->word));
  return DecodeImages(value, &entry->images);
}

Status ReadStored(std::string_view key, std::string_view value, WriteAheadMark* mark) {
  VEDUTA_RETURN_IF_ERROR(ParseMarkKey(key, mark));
  PhotoName name;
  const bool is_name = mark->kind == MarkKind::kPhoto && ParseNameKey(value, &name);
  return value.empty() || is_name ? Status::Ok() : Status::Corruption("no name and contributor");
}

Status ReadStored(std::string_view key, std::string_view value, JournalRecord* record) {
  uint64_t sequence = 0;
  VEDUTA_RETURN_IF_ERROR(ParseJournalKey(key, &sequence));
  return Decode(value, sequence, record);
}

}  // namespace veduta
