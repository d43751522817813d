// SPDX-License-Identifier: Apache-2.0
#include "storage/partial_uploads.h"

#include <string>
#include <string_view>

#include "storage/records/partial_upload_record.h"
#include "storage/uploads.h"

namespace veduta {
namespace {

// A piece that is smaller grows with the bytes that come next, so that however small the parts are
// in which a photo comes, its pieces are few. Chosen by hand: at worst a byte that comes alone is
// written with so many others.
constexpr uint64_t kPieceBytesMin = 256 << 10;

void DeletePieces(const PartialUploadRecord& partial, WriteBuffer* batch) {
  for (uint32_t number = 0; number < partial.piece_count; ++number)
    batch->Delete(Family::kUploads, PieceKey(partial.id, number));
}

}  // namespace

Status PutPartialUpload(DatabaseFiles& files, const PartialUploadRecord& partial, bool sync) {
  WriteBuffer batch(files);
  batch.Put(Family::kContributions, PartialUploadKey(partial.id), Encode(partial));
  return batch.Write(sync, "begin an upload in parts");
}

Status AppendToPartialUpload(DatabaseFiles& files, std::span<const uint8_t> bytes, bool sync,
                             PartialUploadRecord* partial) {
  PartialUploadRecord after = *partial;
  std::string piece;
  if (after.piece_count > 0 && after.last_piece_bytes < kPieceBytesMin) {
    const std::string key = PieceKey(after.id, after.piece_count - 1);
    VEDUTA_ASSIGN_OR_RETURN(const bool found,
                            ValueReader(files, nullptr).Copy(Family::kUploads, key, &piece));
    if (!found || piece.size() != after.last_piece_bytes)
      return InValue(Family::kUploads, key, Status::Corruption("it is not there, or not whole"));
  } else {
    ++after.piece_count;
  }
  piece.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  after.last_piece_bytes = piece.size();
  after.received_bytes += bytes.size();
  WriteBuffer batch(files);
  batch.Put(Family::kUploads, PieceKey(after.id, after.piece_count - 1), std::string_view(piece));
  batch.Put(Family::kContributions, PartialUploadKey(after.id), Encode(after));
  VEDUTA_RETURN_IF_ERROR(batch.Write(sync, "take a part of a photo"));
  *partial = std::move(after);
  return Status::Ok();
}

Status FinishPartialUpload(DatabaseFiles& files, std::span<const uint8_t> photo, bool sync,
                           UploadRecord* upload, PartialUploadRecord* partial) {
  PartialUploadRecord after = *partial;
  WriteBuffer batch(files);
  VEDUTA_RETURN_IF_ERROR(PutUpload(files, upload, photo, &batch));
  DeletePieces(after, &batch);
  after.received_bytes = after.length_bytes;
  after.piece_count = 0;
  after.last_piece_bytes = 0;
  after.upload = upload->number;
  batch.Delete(Family::kContributions, PartialUploadKey(after.id));
  batch.Put(Family::kContributions, PartialUploadKey(after.id, true), Encode(after));
  VEDUTA_RETURN_IF_ERROR(batch.Write(sync, "take a photo into the line"));
  *partial = std::move(after);
  return Status::Ok();
}

Status DeletePartialUpload(DatabaseFiles& files, const PartialUploadRecord& partial) {
  WriteBuffer batch(files);
  DeletePieces(partial, &batch);
  batch.Delete(Family::kContributions, PartialUploadKey(partial.id, partial.upload != 0));
  return batch.Write(/*sync=*/false, "give up an upload in parts");
}

}  // namespace veduta
