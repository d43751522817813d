// SPDX-License-Identifier: Apache-2.0
#include "storage/records/journal_record.h"

#include "storage/records/key_bytes.h"
#include "storage/records/message.h"
#include "storage/records/record_parts.h"
#include "storage/records/schema.capnp.h"

namespace veduta {

std::string JournalKey(uint64_t sequence) {
  std::string key;
  AppendBigEndian64(&key, sequence);
  return key;
}

Status ParseJournalKey(std::string_view key, uint64_t* sequence) {
  return TakeBigEndian64(&key, sequence) && key.empty()
             ? Status::Ok()
             : Status::Corruption("a key of wrong length");
}

Status Check(const JournalRecord& journal) {
  if (journal.sequence == 0) return Broken("journal's sequence", 0, "1 or more");
  return Status::Ok();
}

Result<std::string> Encode(const JournalRecord& journal) {
  VEDUTA_RETURN_IF_ERROR(Check(journal));
  const size_t payload = journal.actor.size() + journal.action.size() + journal.detail.size();
  return WriteMessage<schema::Journal>(payload, [&](auto to) {
    to.setTimeUnixS(journal.time_unix_s);
    to.setActor(AsText(journal.actor));
    to.setAction(AsText(journal.action));
    to.setImage(journal.image.value);
    to.setReconstruction(journal.reconstruction.value);
    to.setDetail(AsText(journal.detail));
  });
}

Status Decode(std::string_view value, uint64_t sequence, JournalRecord* journal) {
  return ReadMessage<schema::Journal>(value, [&](schema::Journal::Reader from) {
    journal->sequence = sequence;
    journal->time_unix_s = from.getTimeUnixS();
    journal->actor = FromText(from.getActor());
    journal->action = FromText(from.getAction());
    journal->image = ImageId(from.getImage());
    journal->reconstruction = ReconstructionId(from.getReconstruction());
    journal->detail = FromText(from.getDetail());
    return Damaged(Check(*journal));
  });
}

}  // namespace veduta
