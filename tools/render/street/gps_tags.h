// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a phone with a GPS receiver writes into its photos.

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "storage/base/status.h"
#include "storage/model/geo.h"

namespace veduta::street {

// The street's x is east there, its y north.
inline constexpr GeoPosition kStreetOrigin{47.07, 15.44, 350};

// Where a receiver believes to be that is at `center_m`. Its errors are normal: those on the plan
// have the deviation along each axis, heights twice of it. Half of the variance is the same error
// in all photos of one seed.
Eigen::Vector3d ReceivedPosition(const Eigen::Vector3d& center_m, double deviation_m, uint64_t seed,
                                 uint64_t photo);

// A position of the street as a receiver tells it.
GpsFix FixAt(const Eigen::Vector3d& position_m, double accuracy_m);

// The JPEG with EXIF's GPS tags, by exiv2: angles to 3 mm, heights to 1 mm. kIoError where it is no
// JPEG.
Result<std::vector<uint8_t>> WithGpsTags(std::span<const uint8_t> jpeg, const GpsFix& fix);

}  // namespace veduta::street
