// SPDX-License-Identifier: Apache-2.0
#include "storage/records/photo_record.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "storage/records/message.h"
#include "storage/records/record_parts.h"
#include "storage/records/schema.capnp.h"

namespace veduta {
namespace {

// Rows are copied as they lie (schema.capnp).
static_assert(sizeof(Keypoint) == 24);

}  // namespace

std::string HashKey(const ContentHash& hash) {
  return {reinterpret_cast<const char*>(hash.bytes.data()), hash.bytes.size()};
}

bool ParseHashKey(std::string_view key, ContentHash* hash) {
  if (key.size() != hash->bytes.size()) return false;
  std::copy(key.begin(), key.end(), hash->bytes.begin());
  return true;
}

Status Check(const Features& features) {
  if (features.descriptors.size() != features.keypoints.size() * kDescriptorSize) {
    return Broken(
        "size of the descriptors", features.descriptors.size(),
        "128 times the number of keypoints, " + std::to_string(features.keypoints.size()));
  }
  for (const Keypoint& k : features.keypoints) {
    // One sum instead of five tests: it is finite only if all are (they are far from overflowing a
    // double).
    const double sum = double{k.x_px} + double{k.y_px} + double{k.scale_px} + double{k.angle_deg} +
                       double{k.response};
    if (!std::isfinite(sum)) return Broken("keypoint", sum, "finite");
  }
  return Status::Ok();
}

Result<std::string> Encode(const Features& features) {
  VEDUTA_RETURN_IF_ERROR(Check(features));
  const size_t payload = features.keypoints.size() * sizeof(Keypoint) + features.descriptors.size();
  return WriteMessage<schema::Features>(payload, [&](auto to) {
    to.setKeypoints(AsData(features.keypoints));
    to.setDescriptors(AsData(features.descriptors));
  });
}

Status Decode(std::string_view value, Features* features) {
  return ReadMessage<schema::Features>(value, [&](schema::Features::Reader from) {
    if (!CopyRows(from.getKeypoints(), &features->keypoints)) return BadRows("keypoints");
    if (!CopyRows(from.getDescriptors(), &features->descriptors)) return BadRows("descriptors");
    return Damaged(Check(*features));
  });
}

std::string HashKeyPrefix(std::string_view digits) {
  std::string bytes;
  for (; digits.size() >= 2; digits.remove_prefix(2)) {
    uint8_t byte = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + 2, byte, 16);
    if (error != std::errc() || end != digits.data() + 2) break;
    bytes += static_cast<char>(byte);
  }
  return bytes;
}

}  // namespace veduta
