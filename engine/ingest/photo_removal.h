// SPDX-License-Identifier: Apache-2.0
#pragma once
// Takes one stored photo out, in one transaction with everything that was derived from it.

#include <string>

#include "engine/door/submission.h"
#include "engine/ingest/ingest_parts.h"
#include "engine/ingest/write_scope.h"

namespace veduta {

// Removes the image and all that stands on it alone; the rest heals: points lose its views, and
// vanish where fewer than two are left. The journal keeps who and why, and of the photo only its
// number. The state notes that files have bytes to be purged. kNotFound where there is no such
// image; kCorruption where what it was part of cannot be read. After an error nothing is committed
// and the map may be half changed: the caller clears it.
Result<RemovedPhoto> RemovePhoto(const IngestParts& parts, ImageId image, const std::string& actor,
                                 const std::string& why, WriteScope scope);

}  // namespace veduta
