// SPDX-License-Identifier: Apache-2.0
#pragma once
// How an entry of the journal is written, by whichever room of the engine did the work.

#include "storage/database.h"
#include "storage/model/journal.h"
#include "storage/model/state.h"

namespace veduta {

// Adds `entry` to the transaction under the next number of the journal, which it takes from `state`
// and counts up there; the caller puts the state into the same transaction afterwards. Fills in
// `sequence` and `time_unix_s` (the clock's time), whatever they were. O(1).
void AppendJournal(JournalRecord entry, DatabaseState* state, Transaction* transaction);

}  // namespace veduta
