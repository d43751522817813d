// SPDX-License-Identifier: Apache-2.0
#include "storage/records/contribution_record.h"

#include "storage/records/image_record.h"
#include "storage/records/key_bytes.h"
#include "storage/records/message.h"
#include "storage/records/record_parts.h"
#include "storage/records/schema.capnp.h"

namespace veduta {
namespace {

std::string EntryKey(ContributionEntry entry, std::string_view rest) {
  return TaggedKey(static_cast<uint8_t>(entry), rest);
}

// Takes the entry's byte and the number of the contribution off the key.
Status TakeNumber(ContributionEntry entry, std::string_view* key, uint32_t* number) {
  if (key->empty() || key->front() != static_cast<char>(entry))
    return Status::Corruption("a key of another kind");
  key->remove_prefix(1);
  if (TakeBigEndian32(key, number) && *number != 0) return Status::Ok();
  return Status::Corruption("a key without a contribution's number");
}

bool HasImage(ContributionFate fate) {
  return fate == ContributionFate::kStored || fate == ContributionFate::kDuplicate;
}

}  // namespace

std::string ContributionKey(uint32_t number) {
  return EntryKey(ContributionEntry::kRecord, Key32(number));
}

std::string ContributionPrefix() {
  return EntryKey(ContributionEntry::kRecord, "");
}

std::string ContributedPhotoKey(uint32_t contribution, uint64_t upload) {
  std::string key = ContributedPhotoPrefix(contribution);
  AppendBigEndian64(&key, upload);
  return key;
}

std::string ContributedPhotoPrefix(uint32_t contribution) {
  return EntryKey(ContributionEntry::kPhoto, Key32(contribution));
}

std::string LastContributionKey() {
  return EntryKey(ContributionEntry::kLastNumber, "");
}

Status ParseContributionKey(std::string_view key, ContributionRecord* contribution) {
  VEDUTA_RETURN_IF_ERROR(TakeNumber(ContributionEntry::kRecord, &key, &contribution->number));
  return key.empty() ? Status::Ok() : Status::Corruption("a key of wrong length");
}

Status ParseContributedPhotoKey(std::string_view key, ContributedPhoto* photo) {
  VEDUTA_RETURN_IF_ERROR(TakeNumber(ContributionEntry::kPhoto, &key, &photo->contribution));
  if (TakeBigEndian64(&key, &photo->upload) && key.empty() && photo->upload != 0)
    return Status::Ok();
  return Status::Corruption("a key without an upload's number");
}

Status Check(const ContributionRecord& contribution) {
  if (contribution.number == 0) return Broken("number of a contribution", 0, "1 or more");
  return Status::Ok();
}

Result<std::string> Encode(const ContributionRecord& contribution) {
  VEDUTA_RETURN_IF_ERROR(Check(contribution));
  const size_t payload =
      contribution.contributor.size() + contribution.comment.size() + contribution.licence.size();
  return WriteMessage<schema::Contribution>(payload, [&](auto to) {
    to.setContributor(AsText(contribution.contributor));
    to.setComment(AsText(contribution.comment));
    to.setLicence(AsText(contribution.licence));
    to.setOpenedUnixS(contribution.opened_unix_s);
    to.setClosedUnixS(contribution.closed_unix_s);
    to.setPhotoCount(contribution.photo_count);
  });
}

Status Decode(std::string_view value, ContributionRecord* contribution) {
  return ReadMessage<schema::Contribution>(value, [&](schema::Contribution::Reader from) {
    contribution->contributor = FromText(from.getContributor());
    contribution->comment = FromText(from.getComment());
    contribution->licence = FromText(from.getLicence());
    contribution->opened_unix_s = from.getOpenedUnixS();
    contribution->closed_unix_s = from.getClosedUnixS();
    contribution->photo_count = from.getPhotoCount();
    return Damaged(Check(*contribution));
  });
}

Status Check(const ContributedPhoto& photo) {
  if (photo.contribution == 0) return Broken("number of a contribution", 0, "1 or more");
  if (photo.upload == 0) return Broken("upload's number", 0, "1 or more");
  if (photo.fate < ContributionFate::kWaiting || photo.fate > ContributionFate::kRemoved)
    return Broken("fate", static_cast<int>(photo.fate), "1 to 6");
  if (photo.image.valid() != HasImage(photo.fate))
    return Broken("image", photo.image.value, "there for what is stored, and for that alone");
  if (!Known(photo.verdict))
    return Broken("verdict", static_cast<int>(photo.verdict), "a known one");
  if (!Known(photo.reason)) return Broken("reason", static_cast<int>(photo.reason), "a known one");
  return Status::Ok();
}

Result<std::string> Encode(const ContributedPhoto& photo) {
  VEDUTA_RETURN_IF_ERROR(Check(photo));
  return WriteMessage<schema::ContributedPhoto>(photo.name.size(), [&](auto to) {
    to.setFate(static_cast<uint8_t>(photo.fate));
    to.setImage(photo.image.value);
    to.setVerdict(static_cast<uint8_t>(photo.verdict));
    to.setReason(static_cast<uint8_t>(photo.reason));
    to.setName(AsText(photo.name));
  });
}

Status Decode(std::string_view value, ContributedPhoto* photo) {
  return ReadMessage<schema::ContributedPhoto>(value, [&](schema::ContributedPhoto::Reader from) {
    photo->fate = static_cast<ContributionFate>(from.getFate());
    photo->image = ImageId(from.getImage());
    photo->verdict = static_cast<Verdict>(from.getVerdict());
    photo->reason = static_cast<Reason>(from.getReason());
    photo->name = FromText(from.getName());
    return Damaged(Check(*photo));
  });
}

}  // namespace veduta
