// SPDX-License-Identifier: Apache-2.0
#include "storage/write_ahead.h"

#include <rocksdb/write_batch.h>

#include <string_view>

#include "storage/records/image_record.h"
#include "storage/records/key_bytes.h"
#include "storage/records/photo_record.h"
#include "storage/records/point_block.h"
#include "storage/records/reconstruction_record.h"
#include "storage/records/state_record.h"
#include "storage/records/vocabulary_record.h"
#include "storage/records/write_ahead_mark.h"
#include "storage/rocksdb_status.h"
#include "storage/value_reader.h"
#include "storage/write_buffer.h"

namespace veduta {
namespace {

std::string_view AsText(std::span<const uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// The generation of point blocks that the reconstruction's record names; 0 where there is no
// record.
Result<uint32_t> CurrentPointsGeneration(const ValueReader& reader, ReconstructionId id) {
  ReconstructionRecord record;
  const auto decode = [&](std::string_view value) { return Decode(value, id, &record); };
  VEDUTA_ASSIGN_OR_RETURN(const bool found,
                          reader.Read(Family::kReconstructions, ReconstructionKey(id), decode));
  return found ? record.points_generation : uint32_t{0};
}

// The generation of the vocabulary that the state names.
Result<uint32_t> CurrentVocabularyGeneration(const ValueReader& reader) {
  DatabaseState state;
  const auto decode = [&](std::string_view value) { return Decode(value, &state); };
  VEDUTA_ASSIGN_OR_RETURN(const bool found, reader.Read(Family::kMeta, kStateKey, decode));
  if (!found) return Status::Corruption("family meta, key 'state': missing");
  return state.vocabulary_generation;
}

Status SweepPhoto(const ValueReader& reader, std::string_view rest, WriteBuffer* batch) {
  ContentHash photo;
  if (!ParseHashKey(rest, &photo)) return Status::Corruption("no content hash");
  const std::string key = HashKey(photo);
  VEDUTA_ASSIGN_OR_RETURN(const bool committed, reader.Has(Family::kHashes, key));
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

// Sweeps what this one mark stands for; nothing where there is no such mark. For who holds the
// commit mutex.
Status SweepOne(DatabaseFiles& files, const std::string& mark, std::string_view doing) {
  const ValueReader reader(files, nullptr);
  VEDUTA_ASSIGN_OR_RETURN(const bool marked, reader.Has(Family::kQueue, mark));
  if (!marked) return Status::Ok();
  WriteBuffer batch(files);
  VEDUTA_RETURN_IF_ERROR(InValue(Family::kQueue, mark, SweepMark(reader, mark, &batch)));
  return batch.Write(/*sync=*/false, doing);
}

// Whether exactly these features are stored.
Result<bool> HasFeatures(const ValueReader& reader, std::string_view key,
                         std::string_view encoded) {
  bool same = false;
  const auto compare = [&](std::string_view value) {
    same = value == encoded;
    return Status::Ok();
  };
  VEDUTA_RETURN_IF_ERROR(reader.Read(Family::kFeatures, key, compare).status());
  return same;
}

}  // namespace

bool PhotoClaims::Add(const ContentHash& photo) {
  const std::lock_guard lock(mutex_);
  return claims_[photo].count++ > 0;
}

bool PhotoClaims::Release(const ContentHash& photo) {
  const std::lock_guard lock(mutex_);
  const auto found = claims_.find(photo);
  if (found == claims_.end()) return true;
  if (--found->second.count > 0) return false;
  claims_.erase(found);
  return true;
}

void PhotoClaims::Forget(const ContentHash& photo) {
  const std::lock_guard lock(mutex_);
  claims_.erase(photo);
}

bool PhotoClaims::Has(const ContentHash& photo) const {
  const std::lock_guard lock(mutex_);
  return claims_.contains(photo);
}

std::vector<ContentHash> PhotoClaims::List() const {
  const std::lock_guard lock(mutex_);
  std::vector<ContentHash> photos;
  for (const auto& [photo, claim] : claims_) photos.push_back(photo);
  return photos;
}

void PhotoClaims::NoteOtherFeatures(const ContentHash& photo) {
  const std::lock_guard lock(mutex_);
  const auto found = claims_.find(photo);
  if (found != claims_.end()) found->second.has_other_features = true;
}

bool PhotoClaims::HasOtherFeatures(const ContentHash& photo) const {
  const std::lock_guard lock(mutex_);
  const auto found = claims_.find(photo);
  return found != claims_.end() && found->second.has_other_features;
}

void PhotoClaims::LoseAllBut(const std::set<ContentHash>& kept) {
  const std::lock_guard lock(mutex_);
  for (auto& [photo, claim] : claims_) claim.is_lost = claim.is_lost || !kept.contains(photo);
}

void PhotoClaims::NoteWritten(const ContentHash& photo) {
  const std::lock_guard lock(mutex_);
  const auto found = claims_.find(photo);
  if (found != claims_.end()) found->second.is_lost = false;
}

Status PhotoClaims::CheckKept(const ContentHash& photo) const {
  const std::lock_guard lock(mutex_);
  const auto found = claims_.find(photo);
  if (found == claims_.end() || !found->second.is_lost) return Status::Ok();
  return Status::IoError("photo " + photo.Hex() +
                         " was lost when a write failed: it has to be written ahead again");
}

Status WritePhotoAhead(DatabaseFiles& files, PhotoClaims& claims, const ContentHash& photo,
                       std::span<const uint8_t> bytes, const Features& features,
                       const PhotoName& name) {
  const std::string key = HashKey(photo);
  const Result<std::string> encoded = Encode(features);
  const std::string mark = name.name.empty() ? "" : NameKey(name.name, name.contributor);
  // No commit may name the photo, and nobody may drop it, between the looks and the write.
  const std::lock_guard lock(files.commit_mutex());
  const ValueReader reader(files, nullptr);
  VEDUTA_ASSIGN_OR_RETURN(const bool committed, reader.Has(Family::kHashes, key));
  if (committed) return Status::Ok();
  const bool was_claimed = claims.Add(photo);
  const auto write = [&]() -> Status {
    // Two records of the log: damage in the features does not cost the photo.
    WriteBuffer derived(files);
    derived.Put(Family::kFeatures, key, encoded);
    VEDUTA_RETURN_IF_ERROR(derived.status());
    if (was_claimed) {
      VEDUTA_ASSIGN_OR_RETURN(const bool same, HasFeatures(reader, key, *encoded));
      if (!same) claims.NoteOtherFeatures(photo);
    }
    WriteBuffer batch(files);
    batch.Put(Family::kPhotos, key, AsText(bytes));
    batch.Put(Family::kQueue, PhotoMarkKey(photo), std::string_view(mark));
    VEDUTA_RETURN_IF_ERROR(batch.Write(/*sync=*/false, "write a photo ahead"));
    return derived.Write(/*sync=*/false, "write features ahead");
  };
  const Status status = write();
  if (status.ok()) {
    claims.NoteWritten(photo);
  } else {
    claims.Release(photo);
  }
  return status;
}

Status DropPhotoAhead(DatabaseFiles& files, PhotoClaims& claims, const ContentHash& photo) {
  // No commit may name the photo between the look and the deletion.
  const std::lock_guard lock(files.commit_mutex());
  if (!claims.Release(photo)) return Status::Ok();
  return SweepOne(files, PhotoMarkKey(photo), "drop a photo written ahead");
}

Status DropPointBlocksAhead(DatabaseFiles& files, ReconstructionId reconstruction,
                            uint32_t generation) {
  const std::lock_guard lock(files.commit_mutex());
  return SweepOne(files, PointBlocksMarkKey(reconstruction, generation),
                  "drop point blocks written ahead");
}

Status DropVocabularyAhead(DatabaseFiles& files, uint32_t generation) {
  const std::lock_guard lock(files.commit_mutex());
  return SweepOne(files, VocabularyMarkKey(generation), "drop a vocabulary written ahead");
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
  batch.Merge(Family::kPostings, PostingsKey(generation, word), EncodeImages(images));
  return batch.Write(/*sync=*/false, "write postings ahead");
}

Status SweepWriteAheads(DatabaseFiles& files, PhotoClaims& claims) {
  const ValueReader reader(files, nullptr);
  WriteBuffer batch(files);
  std::set<ContentHash> kept;
  VEDUTA_RETURN_IF_ERROR(
      reader.Scan(Family::kQueue, "", "", [&](std::string_view key, std::string_view, bool*) {
        ContentHash photo;
        if (ParsePhotoMarkKey(key, &photo) && claims.Has(photo)) {
          // The log may end between the two records of a photo.
          VEDUTA_ASSIGN_OR_RETURN(const bool is_whole,
                                  reader.Has(Family::kFeatures, HashKey(photo)));
          if (is_whole) {
            kept.insert(photo);
            return Status::Ok();
          }
        }
        return SweepMark(reader, key, &batch);
      }));
  // A photo may be committed although it is still claimed: by a copy of it, or because the log had
  // kept a commit that failed.
  for (const ContentHash& photo : claims.List()) {
    VEDUTA_ASSIGN_OR_RETURN(const bool committed, reader.Has(Family::kHashes, HashKey(photo)));
    if (committed) claims.Forget(photo);
  }
  claims.LoseAllBut(kept);
  return batch.Write(/*sync=*/false, "sweep what an interruption left behind");
}

}  // namespace veduta
