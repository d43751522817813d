// SPDX-License-Identifier: Apache-2.0
#pragma once
// Extraction with kernels of one's choice, for tests and benchmarks, and the time of its stages.

#include "engine/features/feature_options.h"
#include "engine/features/sift_kernels.h"
#include "storage/model/features.h"

namespace veduta {

class FeatureScratch;  // engine/features/extractor.h

struct ExtractionTimes {
  double scale_space_ms = 0;  // the doubled image, blurs and extrema
  double description_ms = 0;  // selection, directions and descriptors
};

// As ExtractFeatures. `times` may be null.
Result<Features> ExtractFeaturesWith(const SiftKernels& kernels, const GrayView& image,
                                     const FeatureOptions& options, FeatureScratch* scratch,
                                     ExtractionTimes* times);

}  // namespace veduta
