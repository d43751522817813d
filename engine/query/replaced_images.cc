// SPDX-License-Identifier: Apache-2.0
#include "engine/query/replaced_images.h"

namespace veduta {

Result<std::set<ImageId>> ReplacedImages(const Snapshot& snapshot) {
  std::set<ImageId> replaced;
  VEDUTA_RETURN_IF_ERROR(snapshot.ScanJournal(1, [&](const JournalRecord& entry) {
    if (entry.action == "replace") replaced.insert(entry.image);
    return true;
  }));
  return replaced;
}

}  // namespace veduta
