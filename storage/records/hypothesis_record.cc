// SPDX-License-Identifier: Apache-2.0
#include "storage/records/hypothesis_record.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "storage/records/key_bytes.h"
#include "storage/records/message.h"
#include "storage/records/record_parts.h"
#include "storage/records/schema.capnp.h"

namespace veduta {
namespace {

Status CheckKey(const HypothesisRecord& record) {
  VEDUTA_RETURN_IF_ERROR(CheckId("first reconstruction", record.a));
  if (record.a < record.b) return Status::Ok();
  return Broken("second reconstruction", record.b.value,
                "greater than the first, " + std::to_string(record.a.value));
}

Status CheckImageList(const std::vector<ImageId>& images) {
  if (images.empty()) return Broken("number of images", 0, "1 or more");
  VEDUTA_RETURN_IF_ERROR(CheckId("an image", images.front()));
  if (StrictlyAscending(std::span<const ImageId>(images), std::less<>())) return Status::Ok();
  return Broken("list of images", "out of order", "ascending, each once");
}

Status CheckUnsure(const std::vector<ImageId>& unsure, const std::vector<ImageId>& images) {
  if (!StrictlyAscending(std::span<const ImageId>(unsure), std::less<>()))
    return Broken("list of unsure images", "out of order", "ascending, each once");
  if (std::ranges::includes(images, unsure)) return Status::Ok();
  return Broken("list of unsure images", "with another image", "some of the images at the seam");
}

}  // namespace

std::string HypothesisKey(ReconstructionId smaller, ReconstructionId larger) {
  return std::string(kHypothesisPrefix) + Key32x2(smaller.value, larger.value);
}

Status ParseHypothesisKey(std::string_view key, HypothesisRecord* record) {
  if (!key.starts_with(kHypothesisPrefix)) return Status::Corruption("no such key is known");
  key.remove_prefix(kHypothesisPrefix.size());
  if (!TakeBigEndian32(&key, &record->a.value) || !TakeBigEndian32(&key, &record->b.value) ||
      !key.empty())
    return Status::Corruption("a key of wrong length");
  return Damaged(CheckKey(*record));
}

Status Check(const HypothesisRecord& record) {
  VEDUTA_RETURN_IF_ERROR(CheckKey(record));
  if (record.kind != HypothesisKind::kMerge)
    return Broken("kind of a hypothesis", static_cast<int>(record.kind), "1");
  if (record.reason < RefusalReason::kFewPairs || record.reason > RefusalReason::kFarApart)
    return Broken("reason of a refusal", static_cast<int>(record.reason), "1 to 8");
  const Sim3& s = record.a_from_b;
  if (!(std::isfinite(s.scale) && s.scale > 0))
    return Broken("scale of a_from_b", s.scale, "finite and above 0");
  VEDUTA_RETURN_IF_ERROR(CheckTransform(s.rotation, s.translation));
  if (record.missing_cells > record.judged_cells)
    return Broken("missing_cells", record.missing_cells,
                  "at most those judged, " + std::to_string(record.judged_cells));
  if (record.judgment_count == 0) return Broken("judgment_count", 0, "1 or more");
  VEDUTA_RETURN_IF_ERROR(CheckImageList(record.images));
  return CheckUnsure(record.unsure, record.images);
}

Result<std::string> Encode(const HypothesisRecord& record) {
  VEDUTA_RETURN_IF_ERROR(Check(record));
  const size_t payload = (record.images.size() + record.unsure.size()) * sizeof(ImageId);
  return WriteMessage<schema::Hypothesis>(payload, [&](auto to) {
    to.setKind(static_cast<uint8_t>(record.kind));
    to.setReason(static_cast<uint8_t>(record.reason));
    to.setAFromBScale(record.a_from_b.scale);
    Fill(to.initAFromB(), record.a_from_b.rotation, record.a_from_b.translation);
    to.setCommonPointCount(record.common_point_count);
    to.setAgreeingPairs(record.agreeing_pairs);
    to.setContradictingPairs(record.contradicting_pairs);
    to.setAgreeingMatches(record.agreeing_matches);
    to.setContradictingMatches(record.contradicting_matches);
    to.setJudgedCells(record.judged_cells);
    to.setMissingCells(record.missing_cells);
    to.setImage(record.image.value);
    to.setImages(AsData(record.images));
    to.setUnsure(AsData(record.unsure));
    to.setJudgmentCount(record.judgment_count);
    to.setDue(record.is_due);
    to.setLoopImages(record.loop_images);
    to.setTimeUnixS(record.time_unix_s);
  });
}

Status Decode(std::string_view value, HypothesisRecord* record) {
  return ReadMessage<schema::Hypothesis>(value, [&](schema::Hypothesis::Reader from) {
    record->kind = static_cast<HypothesisKind>(from.getKind());
    record->reason = static_cast<RefusalReason>(from.getReason());
    Sim3& sim = record->a_from_b;
    sim.scale = from.getAFromBScale();
    Read(from.getAFromB(), &sim.rotation, &sim.translation);
    record->common_point_count = from.getCommonPointCount();
    record->agreeing_pairs = from.getAgreeingPairs();
    record->contradicting_pairs = from.getContradictingPairs();
    record->agreeing_matches = from.getAgreeingMatches();
    record->contradicting_matches = from.getContradictingMatches();
    record->judged_cells = from.getJudgedCells();
    record->missing_cells = from.getMissingCells();
    record->image = ImageId(from.getImage());
    if (!CopyRows(from.getImages(), &record->images)) return BadRows("images of a hypothesis");
    if (!CopyRows(from.getUnsure(), &record->unsure)) return BadRows("unsure images");
    record->judgment_count = from.getJudgmentCount();
    record->is_due = from.getDue();
    record->loop_images = from.getLoopImages();
    record->time_unix_s = from.getTimeUnixS();
    return Damaged(Check(*record));
  });
}

}  // namespace veduta
