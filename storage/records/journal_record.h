// SPDX-License-Identifier: Apache-2.0
#pragma once
// Family `journal`. FORMAT.md, section "journal_record".

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/journal.h"

namespace veduta {

std::string JournalKey(uint64_t sequence);
Status ParseJournalKey(std::string_view key, uint64_t* sequence);

Status Check(const JournalRecord& journal);
Result<std::string> Encode(const JournalRecord& journal);
Status Decode(std::string_view value, uint64_t sequence, JournalRecord* journal);

}  // namespace veduta
