// SPDX-License-Identifier: Apache-2.0
#pragma once
// How sure the pose of a stored image is.

#include <optional>

#include "engine/door/answers.h"
#include "engine/mapping/pose_covariance.h"
#include "engine/query/unsure_poses.h"
#include "storage/database.h"

namespace veduta {

// The same without a library's types.
PoseUncertainty ToPlain(const PoseCovariance& found, size_t points, size_t images_held);

// From the image's observations, the points that they see and all that is seen of those; the poses
// of the other images are held, and the points are marginalised (engine/mapping/pose_covariance.h).
// Nothing where the image has no pose or is not sure of it (unsure_poses.h), or its observations do
// not determine it. kCorruption where records that it needs are damaged or contradict each other.
// Thread-safe. O(observations of the points), and it reads the features of every image that sees
// one of them.
Result<std::optional<PoseUncertainty>> UncertaintyOf(const Snapshot& snapshot, ImageId image,
                                                     UnsureCache* unsure);

}  // namespace veduta
