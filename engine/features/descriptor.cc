// SPDX-License-Identifier: Apache-2.0
#include "engine/features/descriptor.h"

#include <algorithm>
#include <cmath>

#include "engine/features/exact_math.h"

namespace veduta {
namespace {

constexpr double kBinSigma = 3.0;  // width of a spatial bin, in the keypoint's scale; as OpenCV
// Sigma of the Gaussian window, in bins: half of the descriptor's width; Lowe 2004, section 6.1.
constexpr double kWindowSigma = 2.0;
constexpr double kSamplesPerBin = 4.0;  // Lowe 2004, figure 7: 16 x 16 samples for 4 x 4 bins

}  // namespace

DescriptorMaker::DescriptorMaker(const SiftKernels& kernels) : kernels_(&kernels) {
  for (int i = 0; i < kGridGradients; ++i) {
    const double bin = (i - 0.5 * (kGridGradients - 1)) / kSamplesPerBin;  // from the middle
    const double window = ExactExp(-0.5 * bin * bin / (kWindowSigma * kWindowSigma));
    for (int c = 0; c < 4; ++c) {
      const double share = std::max(0.0, 1.0 - std::fabs(bin - (c - 1.5)));
      weights_.weight[i][c] = static_cast<float>(share * window);
    }
  }
}

void DescriptorMaker::Make(const GrayPlane& plane, double x, double y, double sigma,
                           float angle_deg, uint8_t* descriptor) const {
  double sine, cosine;
  ExactSinCos(angle_deg, &sine, &cosine);
  const double step = sigma * (kBinSigma / kSamplesPerBin);
  float histogram[128];
  kernels_->describe(plane, static_cast<float>(x), static_cast<float>(y),
                     static_cast<float>(step * cosine), static_cast<float>(step * sine), weights_,
                     histogram);
  kernels_->quantize_descriptor(histogram, descriptor);
}

}  // namespace veduta
