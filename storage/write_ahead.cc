// SPDX-License-Identifier: Apache-2.0
#include "storage/write_ahead.h"

#include <rocksdb/write_batch.h>

#include <string_view>

#include "storage/keys.h"
#include "storage/record_codec.h"
#include "storage/rocksdb_status.h"
#include "storage/value_reader.h"
#include "storage/write_buffer.h"

namespace veduta {
namespace {

std::string_view AsText(std::span<const uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// The number a mark's record has now: the generation that is current. 0 where there is no record.
Result<uint32_t> CurrentPointsGeneration(const ValueReader& reader, ReconstructionId id) {
  rocksdb::PinnableSlice value;
  const std::string key = ReconstructionKey(id);
  VEDUTA_ASSIGN_OR_RETURN(const bool found, reader.Find(Family::kReconstructions, key, &value));
  if (!found) return uint32_t{0};
  ReconstructionRecord record;
  VEDUTA_RETURN_IF_ERROR(
      InValue(Family::kReconstructions, key, Decode(value.ToStringView(), id, &record)));
  return record.points_generation;
}

Result<uint32_t> CurrentVocabularyGeneration(const ValueReader& reader) {
  rocksdb::PinnableSlice value;
  VEDUTA_ASSIGN_OR_RETURN(const bool found, reader.Find(Family::kMeta, kStateKey, &value));
  if (!found) return Status::Corruption("family meta, key 'state': missing");
  DatabaseState state;
  VEDUTA_RETURN_IF_ERROR(InValue(Family::kMeta, kStateKey, Decode(value.ToStringView(), &state)));
  return state.vocabulary_generation;
}

Status SweepPhoto(const ValueReader& reader, std::string_view rest, WriteBuffer* batch) {
  ContentHash photo;
  if (!ParseHashKey(rest, &photo)) return Status::Corruption("no content hash");
  const std::string key = HashKey(photo);
  rocksdb::PinnableSlice value;
  VEDUTA_ASSIGN_OR_RETURN(const bool committed, reader.Find(Family::kHashes, key, &value));
  if (committed) return Status::Ok();
  batch->Delete(Family::kPhotos, key);
  batch->Delete(Family::kFeatures, key);
  return Status::Ok();
}

Status SweepPointBlocks(const ValueReader& reader, std::string_view rest, WriteBuffer* batch) {
  ReconstructionId id;
  uint32_t generation = 0;
  if (!TakeBigEndian32(&rest, &id.value) || !TakeBigEndian32(&rest, &generation) || !rest.empty()) {
    return Status::Corruption("no reconstruction and generation");
  }
  VEDUTA_ASSIGN_OR_RETURN(const uint32_t current, CurrentPointsGeneration(reader, id));
  if (current == generation) return Status::Ok();
  batch->DeletePrefix(Family::kPoints, PointBlockPrefix(id, generation));
  return Status::Ok();
}

Status SweepVocabulary(const ValueReader& reader, std::string_view rest, WriteBuffer* batch) {
  uint32_t generation = 0;
  if (!TakeBigEndian32(&rest, &generation) || !rest.empty())
    return Status::Corruption("no generation");
  VEDUTA_ASSIGN_OR_RETURN(const uint32_t current, CurrentVocabularyGeneration(reader));
  if (current == generation) return Status::Ok();
  batch->DeleteVocabulary(generation);
  return Status::Ok();
}

Status SweepMark(const ValueReader& reader, std::string_view key, WriteBuffer* batch) {
  batch->Delete(Family::kQueue, key);
  if (key.empty()) return Status::Corruption("an empty mark");
  const std::string_view rest = key.substr(1);
  switch (static_cast<MarkKind>(key[0])) {
    case MarkKind::kPhoto:
      return SweepPhoto(reader, rest, batch);
    case MarkKind::kPointBlocks:
      return SweepPointBlocks(reader, rest, batch);
    case MarkKind::kVocabulary:
      return SweepVocabulary(reader, rest, batch);
  }
  return Status::Corruption("a mark of an unknown kind");
}

}  // namespace

void PhotoClaims::Add(const ContentHash& photo) {
  const std::lock_guard lock(mutex_);
  ++counts_[photo];
}

bool PhotoClaims::Release(const ContentHash& photo) {
  const std::lock_guard lock(mutex_);
  const auto found = counts_.find(photo);
  if (found == counts_.end()) return true;
  if (--found->second > 0) return false;
  counts_.erase(found);
  return true;
}

void PhotoClaims::Forget(const ContentHash& photo) {
  const std::lock_guard lock(mutex_);
  counts_.erase(photo);
}

Status WritePhotoAhead(DatabaseFiles& files, PhotoClaims& claims, const ContentHash& photo,
                       std::span<const uint8_t> bytes, const Features& features) {
  const std::string key = HashKey(photo);
  rocksdb::PinnableSlice value;
  claims.Add(photo);
  VEDUTA_ASSIGN_OR_RETURN(const bool committed,
                          ValueReader(files, nullptr).Find(Family::kHashes, key, &value));
  if (committed) return Status::Ok();
  WriteBuffer batch(files);
  batch.Put(Family::kPhotos, key, AsText(bytes));
  batch.Put(Family::kFeatures, key, Encode(features));
  batch.Put(Family::kQueue, PhotoMarkKey(photo), std::string_view());
  return batch.Write(/*sync=*/false, "write a photo ahead");
}

Status DropPhotoAhead(DatabaseFiles& files, PhotoClaims& claims, const ContentHash& photo) {
  // No commit may name the photo between the look and the deletion.
  const std::lock_guard lock(files.commit_mutex());
  if (!claims.Release(photo)) return Status::Ok();
  const ValueReader reader(files, nullptr);
  const std::string mark = PhotoMarkKey(photo);
  rocksdb::PinnableSlice value;
  VEDUTA_ASSIGN_OR_RETURN(const bool marked, reader.Find(Family::kQueue, mark, &value));
  if (!marked) return Status::Ok();
  WriteBuffer batch(files);
  VEDUTA_RETURN_IF_ERROR(InValue(Family::kQueue, mark, SweepMark(reader, mark, &batch)));
  return batch.Write(/*sync=*/false, "drop a photo written ahead");
}

Status WritePointBlocksAhead(DatabaseFiles& files, ReconstructionId reconstruction,
                             uint32_t generation, std::span<const PointBlock> blocks) {
  WriteBuffer batch(files);
  batch.Put(Family::kQueue, PointBlocksMarkKey(reconstruction, generation), std::string_view());
  for (const PointBlock& block : blocks) {
    batch.Put(Family::kPoints, PointBlockKey(reconstruction, generation, block.home),
              Encode(block));
  }
  return batch.Write(/*sync=*/false, "write point blocks ahead");
}

Status WriteVocabularyAhead(DatabaseFiles& files, uint32_t generation,
                            std::span<const uint8_t> tree) {
  WriteBuffer batch(files);
  batch.Put(Family::kQueue, VocabularyMarkKey(generation), std::string_view());
  batch.Put(Family::kVocabulary, VocabularyKey(generation), AsText(tree));
  return batch.Write(/*sync=*/false, "write a vocabulary ahead");
}

Status WriteWordsAhead(DatabaseFiles& files, uint32_t generation, ImageId image,
                       std::span<const WordId> words) {
  WriteBuffer batch(files);
  batch.Put(Family::kQueue, VocabularyMarkKey(generation), std::string_view());
  batch.Put(Family::kWords, WordsKey(generation, image), EncodeWords(words));
  return batch.Write(/*sync=*/false, "write words ahead");
}

Status WritePostingsAhead(DatabaseFiles& files, uint32_t generation, WordId word,
                          std::span<const ImageId> images) {
  WriteBuffer batch(files);
  batch.Put(Family::kQueue, VocabularyMarkKey(generation), std::string_view());
  batch.Put(Family::kPostings, PostingsKey(generation, word), EncodeImages(images));
  return batch.Write(/*sync=*/false, "write postings ahead");
}

Status SweepWriteAheads(DatabaseFiles& files) {
  const ValueReader reader(files, nullptr);
  WriteBuffer batch(files);
  VEDUTA_RETURN_IF_ERROR(
      reader.Scan(Family::kQueue, "", "", [&](std::string_view key, std::string_view, bool*) {
        return SweepMark(reader, key, &batch);
      }));
  return batch.Write(/*sync=*/false, "sweep what an interruption left behind");
}

}  // namespace veduta
