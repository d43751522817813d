// SPDX-License-Identifier: Apache-2.0
#pragma once
// How well the coloured surface, drawn from a photo's camera, looks like the photo.

#include <Eigen/Core>

#include "fusion/surface/renderer.h"
#include "storage/model/view.h"

namespace veduta {

struct ReprojectedColor {
  double covered_share = 0;  // of the photo's pixels
  double median_error = 0;   // median over covered pixels and channels of |picture - photo|, 0..255
  double median_error_balanced =
      0;  // the same median with the photo's light multiplied by its gain (exposure.h)
  double mean_error_balanced = 0;
};

// picture  drawn from the view's camera. view: with rgb. gain: of this photo. All errors 0 where
// nothing is covered. Deterministic, O(pixels). kInvalidArgument if sizes differ or the view has no
// rgb.
Result<ReprojectedColor> CompareWithPhoto(const Picture& picture, const View& view,
                                          const Eigen::Vector3f& gain);

// Photo (times its gain), picture, and their difference (three times, on black) side by side.
Result<Picture> SideBySide(const Picture& picture, const View& view, const Eigen::Vector3f& gain);

}  // namespace veduta
