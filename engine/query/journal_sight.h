// SPDX-License-Identifier: Apache-2.0
#pragma once
// What of the journal, and of other texts that name images, may be told to whoever asks.

#include <string_view>
#include <vector>

#include "engine/door/answers.h"
#include "engine/query/visibility.h"

namespace veduta {

// Whether all images are seen that the text names, as "image 3" or "images 3 and 4". Thread-safe.
// Fails where Visibility::Sees does.
Result<bool> SeesNamed(const Visibility& visibility, std::string_view text);

// Takes all but number, time and action out of entries about images and contributions that must
// not be told, and out of those about what curators hide and people report: who complains of what
// is for curators alone. Where a part of the city alone is seen, also out of those about merges.
// Of the others the detail is taken out where it names an image that must not be told, or where a
// part alone is seen, and then the reconstruction as well unless it is seen. Thread-safe. A few
// reads for each entry, and Visibility::Sees for each reconstruction. Fails where the reads do.
Status MaskEntries(const Visibility& visibility, std::vector<JournalAnswer>* entries);

}  // namespace veduta
