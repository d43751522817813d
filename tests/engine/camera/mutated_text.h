// SPDX-License-Identifier: Apache-2.0
#pragma once
// Damaged copies of a text, for tests of what reads texts from strangers.

#include <cstddef>
#include <string>

#include "storage/base/content_hash.h"

namespace veduta::testing {

// The text after 1 to 4 random changes: a byte replaced, bytes taken out, bytes doubled, or (more
// rarely) the rest cut off.
inline std::string MutatedText(const std::string& text, SeededRandom* random) {
  std::string changed = text;
  for (uint32_t i = 0, count = 1 + random->Below(4); i < count && !changed.empty(); ++i) {
    const size_t at = random->Below(static_cast<uint32_t>(changed.size()));
    switch (random->Below(4)) {
      case 0:
        changed[at] = static_cast<char>(random->Below(256));
        break;
      case 1:
        changed.erase(at, 1 + random->Below(20));
        break;
      case 2:
        changed.insert(at, changed.substr(at, 1 + random->Below(30)));
        break;
      default:
        if (random->Below(4) == 0) changed.resize(at);
    }
  }
  return changed;
}

}  // namespace veduta::testing
