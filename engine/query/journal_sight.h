// SPDX-License-Identifier: Apache-2.0
#pragma once
// What of the journal may be told to whoever asks.

#include <vector>

#include "engine/door/answers.h"
#include "engine/query/visibility.h"

namespace veduta {

// Takes all but number, time and action out of entries about images and contributions that must
// not be told, and out of those about what curators hide and people report: who complains of what
// is for curators alone. A few reads for each entry.
Status MaskEntries(const Visibility& visibility, std::vector<JournalAnswer>* entries);

}  // namespace veduta
