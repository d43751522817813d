// SPDX-License-Identifier: Apache-2.0
#pragma once
// Takes the pose of an image because somebody wants it so, and not because evidence speaks against
// it: the image itself is not tried again.

#include <string>
#include <vector>

#include "engine/ingest/ingest_parts.h"
#include "engine/ingest/write_scope.h"
#include "storage/database.h"

namespace veduta {

// Takes this pose, and those of the images that too few points hold without it: these wait with
// `why` for their detail, are tried again at once, and are returned, ascending. What is around is
// written, the adjustment of the reconstruction is due, and where none of it is left, its
// hypotheses go. The image's own record, what the dense pass has made of these images, and `state`
// are the caller's to write. kCorruption where what the image was part of cannot be read. After an
// error the map may be half changed: the caller clears it. O(what is around the image).
Result<std::vector<ImageId>> RemovePose(const IngestParts& parts, const WriteScope& scope,
                                        const PoseRecord& pose, const std::string& why,
                                        DatabaseState* state);

}  // namespace veduta
