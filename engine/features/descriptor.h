// SPDX-License-Identifier: Apache-2.0
#pragma once
// Descriptors: 4 x 4 histograms of 8 gradient directions each, as bytes. Lowe 2004, section 6; the
// square root is from Arandjelovic and Zisserman 2012.

#include <cstdint>

#include "engine/features/sift_kernels.h"

namespace veduta {

// Holds the weights that all descriptors share. Thread-safe.
class DescriptorMaker final {
 public:
  explicit DescriptorMaker(const SiftKernels& kernels);

  // Writes 128 bytes: 512 times the square root of each bin's share in the sum, so that all
  // descriptors have nearly the same norm, 512. Order: row, column, direction. sigma in px of the
  // plane.
  void Make(const GrayPlane& plane, double x, double y, double sigma, float angle_deg,
            uint8_t* descriptor) const;

 private:
  const SiftKernels* kernels_;
  DescriptorWeights weights_;
};

}  // namespace veduta
