// SPDX-License-Identifier: Apache-2.0
#include "storage/records/pair_record.h"

#include <cmath>

#include "storage/records/key_bytes.h"
#include "storage/records/message.h"
#include "storage/records/record_parts.h"
#include "storage/records/schema.capnp.h"

namespace veduta {
namespace {

static_assert(sizeof(FeatureMatch) == 8);  // rows are copied as they lie (schema.capnp)

// No default: the compiler names an enumerator that was forgotten.
bool Known(PairGeometry geometry) {
  switch (geometry) {
    case PairGeometry::kGeneral:
    case PairGeometry::kPlanar:
    case PairGeometry::kRotation:
      return true;
  }
  return false;
}

Status CheckFocal(const std::string& name, double focal_px) {
  if (focal_px >= 0 && std::isfinite(focal_px)) return Status::Ok();
  return Broken(name, focal_px, "finite, and 0 or more");
}

std::string EntryKey(PairEntry entry, const std::string& rest) {
  return TaggedKey(static_cast<uint8_t>(entry), rest);
}

}  // namespace

std::string NeighborPrefix(ImageId image) {
  return EntryKey(PairEntry::kNeighbor, Key32(image.value));
}

std::string NeighborKey(ImageId image, ImageId other) {
  return EntryKey(PairEntry::kNeighbor, Key32x2(image.value, other.value));
}

std::string PairKey(ImageId smaller, ImageId larger) {
  return EntryKey(PairEntry::kRecord, Key32x2(smaller.value, larger.value));
}

Status Check(const PairRecord& pair) {
  VEDUTA_RETURN_IF_ERROR(CheckId("pair's a", pair.a));
  if (!(pair.a < pair.b))
    return Broken("pair's b", pair.b.value, "greater than a, " + std::to_string(pair.a.value));
  if (!Known(pair.geometry))
    return Broken("pair's geometry", static_cast<uint64_t>(pair.geometry), "a known one");
  VEDUTA_RETURN_IF_ERROR(CheckTransform(pair.b_from_a.rotation, pair.b_from_a.translation));
  VEDUTA_RETURN_IF_ERROR(CheckFocal("pair's focalAPx", pair.lens_a.focal_px));
  VEDUTA_RETURN_IF_ERROR(CheckFocal("pair's focalBPx", pair.lens_b.focal_px));
  VEDUTA_RETURN_IF_ERROR(CheckFinite({{"pair's k1A", pair.lens_a.k1},
                                      {"pair's k2A", pair.lens_a.k2},
                                      {"pair's k1B", pair.lens_b.k1},
                                      {"pair's k2B", pair.lens_b.k2}}));
  const auto less = [](const FeatureMatch& x, const FeatureMatch& y) { return x.a < y.a; };
  if (!StrictlyAscending(std::span<const FeatureMatch>(pair.matches), less)) {
    return Broken("order of the matches", "wrong", "strictly ascending in a");
  }
  return Status::Ok();
}

Result<std::string> Encode(const PairRecord& pair) {
  VEDUTA_RETURN_IF_ERROR(Check(pair));
  return WriteMessage<schema::Pair>(pair.matches.size() * sizeof(FeatureMatch), [&](auto to) {
    to.setGeometry(static_cast<uint8_t>(pair.geometry));
    Fill(to.initBFromA(), pair.b_from_a.rotation, pair.b_from_a.translation);
    to.setMatches(AsData(pair.matches));
    to.setFocalAPx(pair.lens_a.focal_px);
    to.setFocalBPx(pair.lens_b.focal_px);
    to.setK1A(pair.lens_a.k1);
    to.setK2A(pair.lens_a.k2);
    to.setK1B(pair.lens_b.k1);
    to.setK2B(pair.lens_b.k2);
  });
}

Status Decode(std::string_view value, ImageId a, ImageId b, PairRecord* pair) {
  return ReadMessage<schema::Pair>(value, [&](schema::Pair::Reader from) {
    pair->a = a;
    pair->b = b;
    pair->geometry = static_cast<PairGeometry>(from.getGeometry());
    Read(from.getBFromA(), &pair->b_from_a.rotation, &pair->b_from_a.translation);
    if (!CopyRows(from.getMatches(), &pair->matches)) return BadRows("matches");
    pair->lens_a.focal_px = from.getFocalAPx();
    pair->lens_b.focal_px = from.getFocalBPx();
    pair->lens_a.k1 = from.getK1A(), pair->lens_a.k2 = from.getK2A();
    pair->lens_b.k1 = from.getK1B(), pair->lens_b.k2 = from.getK2B();
    return Damaged(Check(*pair));
  });
}

Status Check(const PairNeighbor& neighbor) {
  VEDUTA_RETURN_IF_ERROR(CheckId("neighbor", neighbor.image));
  if (Known(neighbor.geometry)) return Status::Ok();
  return Broken("pair's geometry", static_cast<uint64_t>(neighbor.geometry), "a known one");
}

Result<std::string> Encode(const PairNeighbor& neighbor) {
  VEDUTA_RETURN_IF_ERROR(Check(neighbor));
  return WriteMessage<schema::PairNeighbor>(0, [&](auto to) {
    to.setMatchCount(neighbor.match_count);
    to.setGeometry(static_cast<uint8_t>(neighbor.geometry));
  });
}

Status Decode(std::string_view value, ImageId image, PairNeighbor* neighbor) {
  return ReadMessage<schema::PairNeighbor>(value, [&](schema::PairNeighbor::Reader from) {
    *neighbor = {image, from.getMatchCount(), static_cast<PairGeometry>(from.getGeometry())};
    return Damaged(Check(*neighbor));
  });
}

}  // namespace veduta
