// SPDX-License-Identifier: Apache-2.0
// The PointBlock part of storage/record_codec.h: points as columns.
#include <cstring>
#include <string>
#include <vector>

#include "storage/message.h"
#include "storage/record_check.h"
#include "storage/record_codec.h"
#include "storage/schema.capnp.h"

namespace veduta {
namespace {

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

}  // namespace

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
