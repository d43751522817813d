// SPDX-License-Identifier: Apache-2.0
#include "engine/journal/journal.h"

#include <ctime>
#include <utility>

namespace veduta {

void AppendJournal(JournalRecord entry, DatabaseState* state, Transaction* transaction) {
  entry.sequence = state->next_journal++;
  entry.time_unix_s = std::time(nullptr);
  transaction->AddJournal(entry);
}

}  // namespace veduta
