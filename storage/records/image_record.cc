// SPDX-License-Identifier: Apache-2.0
#include "storage/records/image_record.h"

#include <algorithm>

#include "storage/records/earth_record.h"
#include "storage/records/key_bytes.h"
#include "storage/records/message.h"
#include "storage/records/record_parts.h"
#include "storage/records/schema.capnp.h"

namespace veduta {
namespace {

constexpr uint8_t kOrientationMax = 8;  // EXIF 2.32, tag 274
// In a key of `names` a byte 0 is followed by what it means.
constexpr char kZero = '\0', kEndOfName = '\1', kZeroOfName = '\xff';

Status Check(const TakenTime& taken) {
  if (taken.local_unix_s < kTakenUnixSMin || taken.local_unix_s > kTakenUnixSMax)
    return Broken("time when it was taken", taken.local_unix_s, "in the years 1826 to 9999");
  const int32_t offset_s = taken.offset_s.value_or(0);
  if (offset_s < kTakenOffsetSMin || offset_s > kTakenOffsetSMax)
    return Broken("offset of the camera's clock", offset_s, "-12 to 14 hours");
  return Status::Ok();
}

void Fill(schema::Taken::Builder to, const TakenTime& taken) {
  to.setLocalUnixS(taken.local_unix_s);
  to.setHasOffset(taken.offset_s.has_value());
  to.setOffsetS(taken.offset_s.value_or(0));
}

TakenTime Read(schema::Taken::Reader from) {
  TakenTime taken;
  taken.local_unix_s = from.getLocalUnixS();
  if (from.getHasOffset()) taken.offset_s = from.getOffsetS();
  return taken;
}

}  // namespace

// No default in these switches: the compiler names an enumerator that was forgotten.
bool Known(Verdict verdict) {
  switch (verdict) {
    case Verdict::kPlaced:
    case Verdict::kMerged:
    case Verdict::kFounded:
    case Verdict::kPostponed:
    case Verdict::kRejected:
      return true;
  }
  return false;
}

bool Known(Reason reason) {
  switch (reason) {
    case Reason::kNone:
    case Reason::kRegistered:
    case Reason::kJoinedReconstructions:
    case Reason::kGoodTriple:
    case Reason::kPropagated:
    case Reason::kNoCandidates:
    case Reason::kNoVerifiedNeighbor:
    case Reason::kTooFewStructurePoints:
    case Reason::kResectionFailed:
    case Reason::kNoGoodTriple:
    case Reason::kContradictsNeighbors:
    case Reason::kTooFewFeatures:
    case Reason::kMissingStructure:
    case Reason::kAmbiguous:
    case Reason::kUndetermined:
    case Reason::kDoubted:
    case Reason::kForbidden:
    case Reason::kUnreadable:
    case Reason::kUnsupportedFormat:
    case Reason::kTooLarge:
    case Reason::kWrongSize:
    case Reason::kNoTexture:
    case Reason::kEmptyFile:
    case Reason::kNameTaken:
      return true;
  }
  return false;
}

std::string ImageKey(ImageId id) {
  return Key32(id.value);
}

std::string NamePrefix(std::string_view name) {
  std::string key;
  key.reserve(name.size() + 2);
  for (const char byte : name) {
    key += byte;
    if (byte == kZero) key += kZeroOfName;
  }
  key += kZero;
  key += kEndOfName;
  return key;
}

std::string NameKey(std::string_view name, std::string_view contributor) {
  return NamePrefix(name).append(contributor);
}

bool ParseNameKey(std::string_view key, PhotoName* name) {
  name->name.clear();
  for (size_t i = 0; i < key.size(); ++i) {
    if (key[i] != kZero) {
      name->name += key[i];
      continue;
    }
    if (++i == key.size()) return false;
    if (key[i] == kEndOfName) {
      name->contributor = key.substr(i + 1);
      return true;
    }
    if (key[i] != kZeroOfName) return false;
    name->name += kZero;
  }
  return false;
}

Status Check(const ImageRecord& image) {
  VEDUTA_RETURN_IF_ERROR(CheckId("image", image.id));
  if (!Known(image.verdict))
    return Broken("verdict", static_cast<uint64_t>(image.verdict), "a known one");
  if (!Known(image.reason))
    return Broken("reason", static_cast<uint64_t>(image.reason), "a known one");
  if (image.orientation > kOrientationMax)
    return Broken("orientation", uint64_t{image.orientation}, "0 to 8");
  if (image.taken) VEDUTA_RETURN_IF_ERROR(Check(*image.taken));
  return image.gps ? Check(*image.gps) : Status::Ok();
}

Result<std::string> Encode(const ImageRecord& image) {
  VEDUTA_RETURN_IF_ERROR(Check(image));
  const size_t payload = image.name.size() + image.contributor.size() + image.detail.size() +
                         image.media_type.size() + 32;
  return WriteMessage<schema::Image>(payload, [&](auto to) {
    to.setName(AsText(image.name));
    to.setPhoto(AsData(image.photo.bytes.data(), image.photo.bytes.size()));
    to.setCamera(image.camera.value);
    to.setWidthPx(image.width_px);
    to.setHeightPx(image.height_px);
    to.setSizeBytes(image.size_bytes);
    to.setFeatureCount(image.feature_count);
    to.setContributor(AsText(image.contributor));
    to.setTimeUnixS(image.time_unix_s);
    to.setVerdict(static_cast<uint8_t>(image.verdict));
    to.setReason(static_cast<uint8_t>(image.reason));
    to.setDetail(AsText(image.detail));
    if (image.gps) Fill(to.initGps(), *image.gps);
    if (image.taken) Fill(to.initTaken(), *image.taken);
    if (!image.media_type.empty()) to.setMediaType(AsText(image.media_type));
    to.setContribution(image.contribution);
    to.setOrientation(image.orientation);
  });
}

Status Decode(std::string_view value, ImageId id, ImageRecord* image) {
  return ReadMessage<schema::Image>(value, [&](schema::Image::Reader from) {
    image->id = id;
    image->name = FromText(from.getName());
    const capnp::Data::Reader photo = from.getPhoto();
    if (photo.size() != image->photo.bytes.size()) return BadRows("photo");
    std::copy(photo.begin(), photo.end(), image->photo.bytes.begin());
    image->camera = CameraId(from.getCamera());
    image->width_px = from.getWidthPx();
    image->height_px = from.getHeightPx();
    image->size_bytes = from.getSizeBytes();
    image->feature_count = from.getFeatureCount();
    image->contributor = FromText(from.getContributor());
    image->time_unix_s = from.getTimeUnixS();
    image->verdict = static_cast<Verdict>(from.getVerdict());
    image->reason = static_cast<Reason>(from.getReason());
    image->detail = FromText(from.getDetail());
    image->gps.reset();
    if (from.hasGps()) image->gps = Read(from.getGps());
    image->taken.reset();
    if (from.hasTaken()) image->taken = Read(from.getTaken());
    image->media_type = FromText(from.getMediaType());
    image->contribution = from.getContribution();
    image->orientation = from.getOrientation();
    return Damaged(Check(*image));
  });
}

}  // namespace veduta
