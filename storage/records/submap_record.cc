// SPDX-License-Identifier: Apache-2.0
#include "storage/records/submap_record.h"

#include <cmath>
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
  if (record.images_at_adjustment > record.images.size())
    return Broken("images_at_adjustment", record.images_at_adjustment,
                  "at most the number of images, " + std::to_string(record.images.size()));
  if (!record.motion) return Status::Ok();
  const Sim3& motion = *record.motion;
  if (!(std::isfinite(motion.scale) && motion.scale > 0))
    return Broken("scale of the motion", motion.scale, "finite and above 0");
  return CheckTransform(motion.rotation, motion.translation);
}

Result<std::string> Encode(const SubmapRecord& record) {
  VEDUTA_RETURN_IF_ERROR(Check(record));
  return WriteMessage<schema::Submap>(record.images.size() * sizeof(ImageId), [&](auto to) {
    to.setReconstruction(record.reconstruction.value);
    to.setImages(AsData(record.images));
    to.setImagesAtAdjustment(record.images_at_adjustment);
    if (!record.motion) return;
    to.setMoves(true);
    to.setMotionScale(record.motion->scale);
    Fill(to.initMotion(), record.motion->rotation, record.motion->translation);
  });
}

Status Decode(std::string_view value, SubmapRecord* record) {
  return ReadMessage<schema::Submap>(value, [&](schema::Submap::Reader from) {
    record->reconstruction = ReconstructionId(from.getReconstruction());
    if (!CopyRows(from.getImages(), &record->images)) return BadRows("images");
    record->images_at_adjustment = from.getImagesAtAdjustment();
    record->motion.reset();
    if (from.getMoves()) {
      record->motion.emplace();
      record->motion->scale = from.getMotionScale();
      Read(from.getMotion(), &record->motion->rotation, &record->motion->translation);
    }
    return Damaged(Check(*record));
  });
}

}  // namespace veduta
