// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the dense pass has made of images that are removed or have lost their poses.

#include <span>

#include "storage/database.h"

namespace veduta {

// Deletes what was made from the images, so that the next pass makes it anew without them: their
// depth maps, those of which they were sensor views, the checked ones that were checked against
// theirs, and the tiles that hold any of these, with all their parts. Returns whether there was
// something. Once in a transaction. O(depth maps and tiles of the database), reading records only.
Result<bool> RemoveFromDense(const Snapshot& snapshot, std::span<const ImageId> images,
                             Transaction* transaction);

}  // namespace veduta
