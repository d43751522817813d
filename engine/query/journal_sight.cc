// SPDX-License-Identifier: Apache-2.0
#include "engine/query/journal_sight.h"

#include <charconv>
#include <string_view>

namespace veduta {
namespace {

constexpr std::string_view kOfCurators[] = {"hide", "unhide", "report", "dismiss"};

// The number of the contribution that such an entry is about, which its detail ends with; 0 where
// it does not.
uint32_t ContributionOf(std::string_view detail) {
  detail.remove_prefix(detail.find_last_of(' ') + 1);
  uint32_t number = 0;
  std::from_chars(detail.data(), detail.data() + detail.size(), number);
  return number;
}

Result<bool> MayTell(const Visibility& visibility, const JournalAnswer& entry) {
  for (const std::string_view action : kOfCurators) {
    if (entry.action == action) return false;
  }
  if (entry.image.valid()) return visibility.Sees(entry.image);
  if (entry.action != "contribution") return visibility.SeesWhole();
  return visibility.SeesContribution(ContributionOf(entry.detail));
}

}  // namespace

Status MaskEntries(const Visibility& visibility, std::vector<JournalAnswer>* entries) {
  if (visibility.SeesAll()) return Status::Ok();
  for (JournalAnswer& entry : *entries) {
    VEDUTA_ASSIGN_OR_RETURN(const bool may_tell, MayTell(visibility, entry));
    if (may_tell) continue;
    JournalAnswer masked;
    masked.sequence = entry.sequence;
    masked.time_unix_s = entry.time_unix_s;
    masked.action = std::move(entry.action);
    entry = std::move(masked);
  }
  return Status::Ok();
}

}  // namespace veduta
