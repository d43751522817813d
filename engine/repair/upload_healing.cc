// SPDX-License-Identifier: Apache-2.0
// Photos that wait for their turn, or arrive in parts. Nothing is derived from them yet: each is
// whole, or lost.
#include <vector>

#include "engine/repair/healing.h"
#include "storage/records/upload_record.h"

namespace veduta {
namespace {

std::string TextOf(const UploadRecord& upload) {
  return "photo '" + upload.name + "' of " + upload.contributor + ", which waited for its turn";
}

// The numbers of those that something is stored of, as far as that can be told.
Result<std::vector<uint64_t>> NumbersOf(const Snapshot& from) {
  std::vector<uint64_t> numbers;
  const Status scanned =
      from.ScanStored(Family::kUploads, [&](std::string_view key, const Result<StoredBytes>&) {
        UploadEntry entry{};
        uint64_t number = 0;
        if (ParseUploadKey(key, &entry, &number).ok() && entry == UploadEntry::kRecord)
          numbers.push_back(number);
        return true;
      });
  if (!scanned.ok() && !IsDamage(scanned)) return scanned;
  return numbers;
}

}  // namespace

namespace {

// Those whose bytes are whole so far; the others have to be sent again. That others have arrived is
// forgotten: who sent them hears that their photos are there.
Status HealPartialUploads(const Snapshot& from, Database* target, RepairNotes* notes) {
  const Result<std::vector<PartialUploadRecord>> all = from.contributing().ListPartialUploads();
  if (!all.ok()) {
    if (!IsDamage(all.status())) return all.status();
    notes->Add("uploads in parts cannot be read: " + all.status().message(),
               "they are left out: they have to be sent again");
    return Status::Ok();
  }
  for (const PartialUploadRecord& stored : *all) {
    const Result<std::vector<uint8_t>> bytes = from.contributing().GetPieces(stored);
    if (!bytes.ok()) {
      if (!IsDamage(bytes.status())) return bytes.status();
      notes->Add("what has come of photo '" + stored.name + "' of " + stored.contributor +
                     " cannot be read",
                 "it is left out: it has to be sent again");
      continue;
    }
    if (target == nullptr) continue;
    PartialUploadRecord anew = stored;
    anew.received_bytes = anew.last_piece_bytes = 0;
    anew.piece_count = 0;
    VEDUTA_RETURN_IF_ERROR(bytes->empty() ? target->PutPartialUpload(anew)
                                          : target->AppendToPartialUpload(*bytes, &anew));
  }
  return Status::Ok();
}

}  // namespace

Status HealUploads(const Salvage& source, Database* target, RepairNotes* notes) {
  const Snapshot& from = source.snapshot();
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<uint64_t> numbers, NumbersOf(from));
  for (const uint64_t number : numbers) {
    Result<UploadRecord> upload = from.GetUpload(number);
    if (!upload.ok()) {
      if (!IsDamage(upload.status())) return upload.status();
      notes->Add(
          "upload " + std::to_string(number) + " cannot be read: " + upload.status().message(),
          "it is left out: it has to be sent again");
      continue;
    }
    const Result<StoredBytes> bytes = from.GetUploadBytes(number);
    if (!bytes.ok() && !IsDamage(bytes.status())) return bytes.status();
    if (!bytes.ok() || HashContent(bytes->bytes()) != upload->photo) {
      notes->Add(TextOf(*upload) + ", cannot be read", "it is left out: it has to be sent again");
      notes->lost.push_back(upload->name);
      continue;
    }
    if (target != nullptr)
      VEDUTA_RETURN_IF_ERROR(target->AddUpload(*std::move(upload), bytes->bytes()).status());
  }
  return HealPartialUploads(from, target, notes);
}

}  // namespace veduta
