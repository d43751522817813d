// SPDX-License-Identifier: Apache-2.0
#pragma once
// One image's strongest descriptors, laid out once for matching against many other images.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/matching/contrast_class.h"
#include "engine/matching/matcher_kernels.h"
#include "storage/base/ids.h"
#include "storage/base/status.h"
#include "storage/model/features.h"

namespace veduta {

inline constexpr uint32_t kPackedCountMax = 65535;

// Immutable: thread-safe. About 140 bytes for each descriptor.
class PackedDescriptors final {
 public:
  PackedDescriptors() = default;

  // Packs the first min(count_max, size()) features: the strongest. About 0.1 ms for 1500.
  // kInvalidArgument when count_max exceeds 65535 or `features` has not 128 bytes for
  // each keypoint.
  static Result<PackedDescriptors> Pack(const Features& features, uint32_t count_max);
  // Ok where Pack is.
  static Status Check(const Features& features, uint32_t count_max);

  uint32_t count() const { return static_cast<uint32_t>(feature_of_.size()); }
  size_t size_bytes() const;

  // The panels of one contrast class, and the feature that column `ordinal` of them is. Ordinals
  // ascend with features.
  PanelSpan span(int contrast) const {
    return {panels_.data() + first_panel_[contrast], counts_[contrast]};
  }
  FeatureIndex feature(int contrast, uint32_t ordinal) const {
    return feature_of_[first_[contrast] + ordinal];
  }

 private:
  std::array<uint32_t, kContrastClassCount> counts_{};
  std::array<uint32_t, kContrastClassCount> first_{};        // in feature_of_
  std::array<uint32_t, kContrastClassCount> first_panel_{};  // in panels_
  std::vector<FeatureIndex> feature_of_;
  std::vector<DescriptorPanel> panels_;
};

}  // namespace veduta
