// SPDX-License-Identifier: Apache-2.0
#pragma once
// Random numbers within bounds, drawn one by one: the order in which a call's arguments are
// computed is the compiler's choice, and a seed is to be the same street with each.

#include <Eigen/Core>

#include "storage/base/content_hash.h"

namespace veduta::street {

inline double Between(SeededRandom& random, double low, double high) {
  return low + (high - low) * random.Unit();
}

// Draws z first, then y, then x.
inline Eigen::Vector3d Between(SeededRandom& random, const Eigen::Vector3d& low,
                               const Eigen::Vector3d& high) {
  const double z = Between(random, low.z(), high.z());
  const double y = Between(random, low.y(), high.y());
  return {Between(random, low.x(), high.x()), y, z};
}

}  // namespace veduta::street
