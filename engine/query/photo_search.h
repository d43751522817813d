// SPDX-License-Identifier: Apache-2.0
#pragma once
// Stored photos by when and where they were taken, read from one snapshot. Rejected ones are not
// stored, and never found.

#include "engine/door/photo_search.h"
#include "engine/query/unsure_poses.h"
#include "storage/database.h"

namespace veduta {

// Reads a record or two of each photo that it looks at, at most kSearchedPhotosMax.
Result<FoundPhotos> SearchPhotos(const Snapshot& snapshot, const PhotoSearch& search,
                                 UnsureCache* unsure);

// The same of all photos of a city that has at most kSearchedPhotosMax; of a larger one nothing is
// told.
Result<PhotoExtent> ExtentOf(const Snapshot& snapshot, UnsureCache* unsure);

}  // namespace veduta
