// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the dense pass has made of an image that is removed.

#include "storage/database.h"

namespace veduta {

// Deletes what was made from the image, so that the next pass makes it anew without it: its depth
// maps, those of which it was a sensor view, the checked ones that were checked against its own,
// and the tiles that hold any of these with all their parts. Returns whether there was something.
// O(depth maps and tiles of the database), reading records only.
Result<bool> RemoveFromDense(const Snapshot& snapshot, ImageId image, Transaction* transaction);

}  // namespace veduta
