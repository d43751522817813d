// SPDX-License-Identifier: Apache-2.0
#pragma once
// Every field of a hypothesis, each with a change.

#include <vector>

#include "storage/records/hypothesis_record.h"
#include "tests/engine/query/field_edit.h"

namespace veduta {

inline std::vector<FieldDamage> HypothesisDamages() {
  using R = HypothesisRecord;
  const auto read = [](const std::string& key, const std::string& value, R* record) {
    VEDUTA_RETURN_IF_ERROR(ParseHypothesisKey(key, record));
    return Decode(value, record);
  };
  return DamagesOf<R>(
      {{"hypothesis: reason",
        [](R* r) {
          r->reason = r->reason == RefusalReason::kFewPairs ? RefusalReason::kContradicted
                                                            : RefusalReason::kFewPairs;
        }},
       {"hypothesis: aFromBScale", [](R* r) { r->a_from_b.scale *= 1.1; }},
       {"hypothesis: aFromB",
        [](R* r) {
          r->a_from_b.rotation = r->a_from_b.rotation.conjugate();
          r->a_from_b.translation.x() += 0.1;
        }},
       {"hypothesis: commonPointCount", [](R* r) { r->common_point_count += 1; }},
       {"hypothesis: agreeingPairs", [](R* r) { r->agreeing_pairs += 1; }},
       {"hypothesis: contradictingPairs", [](R* r) { r->contradicting_pairs += 1; }},
       {"hypothesis: agreeingMatches", [](R* r) { r->agreeing_matches += 1; }},
       {"hypothesis: contradictingMatches", [](R* r) { r->contradicting_matches += 1; }},
       {"hypothesis: judgedCells", [](R* r) { r->judged_cells += 1; }},
       {"hypothesis: missingCells", [](R* r) { r->missing_cells -= 1; }},
       {"hypothesis: image", [](R* r) { r->image = {}; }},
       {"hypothesis: image, beyond all", [](R* r) { r->image = ImageId(999); }},
       {"hypothesis: images, one less",
        [](R* r) {
          std::erase(r->unsure, r->images.back());
          r->images.pop_back();
        }},
       {"hypothesis: unsure",
        [](R* r) { r->unsure = r->unsure == r->images ? std::vector<ImageId>() : r->images; }},
       {"hypothesis: images, beyond all", [](R* r) { r->images.push_back(ImageId(999)); }},
       {"hypothesis: judgmentCount", [](R* r) { r->judgment_count += 1; }},
       {"hypothesis: due", [](R* r) { r->is_due ^= true; }},
       {"hypothesis: loopImages", [](R* r) { r->loop_images += 1; }},
       {"hypothesis: timeUnixS", [](R* r) { r->time_unix_s += 1; }}},
      read, [](const R& record) { return Encode(record); });
}

}  // namespace veduta
