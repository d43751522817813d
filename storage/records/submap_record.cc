// SPDX-License-Identifier: Apache-2.0
#include "storage/records/submap_record.h"

#include <functional>

#include "storage/records/key_bytes.h"
#include "storage/records/message.h"
#include "storage/records/record_parts.h"
#include "storage/records/schema.capnp.h"

namespace veduta {

std::string SubmapKey(SubmapId id) {
  return std::string(kSubmapPrefix) + Key32(id.value);
}

Status ParseSubmapKey(std::string_view key, SubmapRecord* record) {
  if (!key.starts_with(kSubmapPrefix)) return Status::Corruption("no such key is known");
  key.remove_prefix(kSubmapPrefix.size());
  if (!TakeBigEndian32(&key, &record->id.value) || !key.empty())
    return Status::Corruption("a key of wrong length");
  return Damaged(CheckId("submap", record->id));
}

Status Check(const SubmapRecord& record) {
  VEDUTA_RETURN_IF_ERROR(CheckId("submap", record.id));
  VEDUTA_RETURN_IF_ERROR(CheckId("reconstruction of a submap", record.reconstruction));
  if (record.images.empty()) return Broken("number of images", 0, "1 or more");
  VEDUTA_RETURN_IF_ERROR(CheckId("an image", record.images.front()));
  if (!StrictlyAscending(std::span<const ImageId>(record.images), std::less<>()))
    return Broken("list of images", "out of order", "ascending, each once");
  if (record.images_at_adjustment <= record.images.size()) return Status::Ok();
  return Broken("images_at_adjustment", record.images_at_adjustment,
                "at most the number of images, " + std::to_string(record.images.size()));
}

Result<std::string> Encode(const SubmapRecord& record) {
  VEDUTA_RETURN_IF_ERROR(Check(record));
  return WriteMessage<schema::Submap>(record.images.size() * sizeof(ImageId), [&](auto to) {
    to.setReconstruction(record.reconstruction.value);
    to.setImages(AsData(record.images));
    to.setImagesAtAdjustment(record.images_at_adjustment);
  });
}

Status Decode(std::string_view value, SubmapRecord* record) {
  return ReadMessage<schema::Submap>(value, [&](schema::Submap::Reader from) {
    record->reconstruction = ReconstructionId(from.getReconstruction());
    if (!CopyRows(from.getImages(), &record->images)) return BadRows("images");
    record->images_at_adjustment = from.getImagesAtAdjustment();
    return Damaged(Check(*record));
  });
}

}  // namespace veduta
