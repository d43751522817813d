// SPDX-License-Identifier: Apache-2.0
#pragma once
// Stored photos by when and where they were taken, read from one snapshot. Rejected ones are not
// stored, and never found.

#include "engine/door/moderation.h"
#include "engine/door/photo_search.h"
#include "engine/query/unsure_poses.h"
#include "storage/database.h"

namespace veduta {

// Photos that are out of sight are not found. Reads a record or two of each photo that it looks at,
// at most kSearchedPhotosMax.
Result<FoundPhotos> SearchPhotos(const Snapshot& snapshot, const PhotoSearch& search,
                                 UnsureCache* unsure, const Sight& sight = {});

// The same of all photos of a city that has at most kSearchedPhotosMax; of a larger one nothing is
// told.
Result<PhotoExtent> ExtentOf(const Snapshot& snapshot, UnsureCache* unsure,
                             const Sight& sight = {});

}  // namespace veduta
