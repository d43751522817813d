// SPDX-License-Identifier: Apache-2.0
#include "storage/records/point_block.h"

#include <cmath>
#include <cstring>
#include <vector>

#include "storage/records/key_bytes.h"
#include "storage/records/message.h"
#include "storage/records/record_parts.h"
#include "storage/records/schema.capnp.h"

namespace veduta {
namespace {

static_assert(sizeof(TrackElement) == 8);  // rows are copied as they lie (schema.capnp)

struct Columns {
  std::vector<uint32_t> ordinals;
  std::vector<double> positions;
  std::vector<uint8_t> colors;
  std::vector<float> errors_px;
  std::vector<uint32_t> track_lengths;
  std::vector<TrackElement> track_elements;
};

Columns ToColumns(const PointBlock& block) {
  Columns c;
  const size_t count = block.points.size();
  c.ordinals.reserve(count);
  c.positions.reserve(count * 3);
  c.colors.reserve(count * 3);
  c.errors_px.reserve(count);
  c.track_lengths.reserve(count);
  for (const PointRecord& point : block.points) {
    c.ordinals.push_back(point.id.ordinal);
    for (int i = 0; i < 3; ++i) c.positions.push_back(point.position[i]);
    c.colors.insert(c.colors.end(), point.rgb.begin(), point.rgb.end());
    c.errors_px.push_back(point.error_px);
    c.track_lengths.push_back(static_cast<uint32_t>(point.track.size()));
    c.track_elements.insert(c.track_elements.end(), point.track.begin(), point.track.end());
  }
  return c;
}

Status ReadColumns(schema::PointBlock::Reader from, Columns* c) {
  if (!CopyRows(from.getOrdinals(), &c->ordinals))
    return Status::Corruption("ordinals has a broken row");
  if (!CopyRows(from.getPositions(), &c->positions))
    return Status::Corruption("positions has a broken row");
  if (!CopyRows(from.getColors(), &c->colors)) return Status::Corruption("colors has a broken row");
  if (!CopyRows(from.getErrorsPx(), &c->errors_px))
    return Status::Corruption("errorsPx has a broken row");
  if (!CopyRows(from.getTrackLengths(), &c->track_lengths))
    return Status::Corruption("trackLengths has a broken row");
  if (!CopyRows(from.getTrackElements(), &c->track_elements)) {
    return Status::Corruption("trackElements has a broken row");
  }
  const size_t count = c->ordinals.size();
  uint64_t elements = 0;
  for (const uint32_t length : c->track_lengths) elements += length;
  if (c->positions.size() != count * 3 || c->colors.size() != count * 3 ||
      c->errors_px.size() != count || c->track_lengths.size() != count ||
      c->track_elements.size() != elements) {
    return Status::Corruption("columns of a point block differ in length");
  }
  return Status::Ok();
}

Status CheckPoint(const PointRecord& point, ImageId home, uint32_t next_ordinal) {
  if (point.id.home != home) return Broken("point's home", point.id.home.value, "the block's");
  if (point.id.ordinal == 0 || point.id.ordinal >= next_ordinal) {
    return Broken("point's ordinal", point.id.ordinal,
                  "from 1 up and below next_ordinal " + std::to_string(next_ordinal));
  }
  if (!point.position.allFinite())
    return Broken("point's position", point.position.sum(), "finite");
  if (!std::isfinite(point.error_px)) return Broken("point's error_px", point.error_px, "finite");
  if (point.track.size() < 2)
    return Broken("point's track length", point.track.size(), "2 or more");
  for (size_t i = 0; i < point.track.size(); ++i) {
    VEDUTA_RETURN_IF_ERROR(CheckId("image in a track", point.track[i].image));
    if (i > 0 && point.track[i].image <= point.track[i - 1].image) {
      return Broken("image in a track", point.track[i].image.value, "ascending");
    }
  }
  return Status::Ok();
}

}  // namespace

std::string PointBlockPrefix(ReconstructionId reconstruction, uint32_t generation) {
  return Key32x2(reconstruction.value, generation);
}

std::string PointBlockKey(ReconstructionId reconstruction, uint32_t generation, ImageId home) {
  std::string key = PointBlockPrefix(reconstruction, generation);
  AppendBigEndian32(&key, home.value);
  return key;
}

Status Check(const PointBlock& block) {
  VEDUTA_RETURN_IF_ERROR(CheckId("block's home", block.home));
  if (block.next_ordinal == 0) return Broken("next_ordinal", 0, "1 or more");
  for (size_t i = 0; i < block.points.size(); ++i) {
    VEDUTA_RETURN_IF_ERROR(CheckPoint(block.points[i], block.home, block.next_ordinal));
    if (i > 0 && block.points[i].id.ordinal <= block.points[i - 1].id.ordinal) {
      return Broken("point's ordinal", block.points[i].id.ordinal, "ascending");
    }
  }
  return Status::Ok();
}

Result<std::string> Encode(const PointBlock& block) {
  VEDUTA_RETURN_IF_ERROR(Check(block));
  const Columns c = ToColumns(block);
  const size_t payload =
      c.ordinals.size() * (4 + 24 + 3 + 4 + 4) + c.track_elements.size() * sizeof(TrackElement);
  return WriteMessage<schema::PointBlock>(payload, [&](auto to) {
    to.setNextOrdinal(block.next_ordinal);
    to.setOrdinals(AsData(c.ordinals));
    to.setPositions(AsData(c.positions));
    to.setColors(AsData(c.colors));
    to.setErrorsPx(AsData(c.errors_px));
    to.setTrackLengths(AsData(c.track_lengths));
    to.setTrackElements(AsData(c.track_elements));
  });
}

Status Decode(std::string_view value, ImageId home, PointBlock* block) {
  return ReadMessage<schema::PointBlock>(value, [&](schema::PointBlock::Reader from) {
    Columns c;
    VEDUTA_RETURN_IF_ERROR(ReadColumns(from, &c));
    block->home = home;
    block->next_ordinal = from.getNextOrdinal();
    block->points.clear();
    block->points.resize(c.ordinals.size());
    auto element = c.track_elements.begin();
    for (size_t i = 0; i < block->points.size(); ++i) {
      PointRecord& point = block->points[i];
      point.id = {home, c.ordinals[i]};
      point.position =
          Eigen::Vector3d(c.positions[3 * i], c.positions[3 * i + 1], c.positions[3 * i + 2]);
      point.rgb = {c.colors[3 * i], c.colors[3 * i + 1], c.colors[3 * i + 2]};
      point.error_px = c.errors_px[i];
      point.track.assign(element, element + c.track_lengths[i]);
      element += c.track_lengths[i];
    }
    const Status check = Check(*block);
    return check.ok() ? check : Status::Corruption(check.message());
  });
}

}  // namespace veduta
