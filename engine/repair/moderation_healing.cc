// SPDX-License-Identifier: Apache-2.0
// What is hidden, reported and used up is taken over, or lost.
#include "engine/repair/healing.h"

namespace veduta {
namespace {

// Takes over all records of a kind; one that cannot be read costs those of its kind.
template <typename Record, typename Put>
Status HealKind(HealingWork* healing, const Result<std::vector<Record>>& all, const char* what,
                const char* remedy, const Put& put) {
  if (!all.ok()) {
    if (!IsDamage(all.status())) return all.status();
    healing->notes.Add(std::string(what) + " cannot be read: " + all.status().message(), remedy);
    return Status::Ok();
  }
  for (const Record& record : *all) {
    VEDUTA_RETURN_IF_ERROR(
        healing->writer.Put([&](Transaction& transaction) { put(transaction, record); }));
  }
  return Status::Ok();
}

}  // namespace

Status HealModeration(HealingWork* healing) {
  const ModerationReader& from = healing->from().moderation();
  // What was hidden of photos that are lost stays hidden in the journal.
  VEDUTA_RETURN_IF_ERROR(
      HealKind(healing, from.ListHidden(), "what was hidden",
               "nothing is hidden any more: 'veduta journal' tells what was",
               [](Transaction& to, const HiddenRecord& hidden) { to.PutHidden(hidden); }));
  return HealKind(healing, from.ListReports(), "the reports",
                  "there are none any more: people may report photos again",
                  [](Transaction& to, const ReportRecord& report) { to.PutReport(report); });
}

}  // namespace veduta
