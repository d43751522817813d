// SPDX-License-Identifier: Apache-2.0
#include "engine/matching/packed_descriptors.h"

#include <algorithm>
#include <cstring>
#include <string>

namespace veduta {
namespace {

void WriteColumn(const uint8_t* descriptor, int column, DescriptorPanel* panel) {
  int32_t norm_squared = 0;
  int32_t sum = 0;
  for (int i = 0; i < kDescriptorSize; ++i) {
    norm_squared += descriptor[i] * descriptor[i];
    sum += descriptor[i];
  }
  for (int group = 0; group < kPanelGroups; ++group) {
    std::memcpy(panel->bytes[group][column], descriptor + group * 4, 4);
  }
  panel->norms_squared[column] = norm_squared;
  panel->sums[column] = sum;
}

}  // namespace

Status PackedDescriptors::Check(const Features& features, uint32_t count_max) {
  if (count_max > kPackedCountMax) {
    return Status::InvalidArgument("cannot pack " + std::to_string(count_max) +
                                   " descriptors an image; at most " +
                                   std::to_string(kPackedCountMax));
  }
  if (features.descriptors.size() != features.size() * kDescriptorSize) {
    return Status::InvalidArgument(std::to_string(features.size()) + " keypoints come with " +
                                   std::to_string(features.descriptors.size()) +
                                   " bytes of descriptors, not 128 each");
  }
  return Status::Ok();
}

Result<PackedDescriptors> PackedDescriptors::Pack(const Features& features, uint32_t count_max) {
  VEDUTA_RETURN_IF_ERROR(Check(features, count_max));
  const uint32_t count = static_cast<uint32_t>(std::min<size_t>(count_max, features.size()));
  PackedDescriptors packed;
  for (uint32_t i = 0; i < count; ++i)
    ++packed.counts_[ContrastClassOf(features.keypoints[i].contrast_sign)];
  uint32_t first = 0;
  uint32_t panel_count = 0;
  for (int contrast = 0; contrast < kContrastClassCount; ++contrast) {
    packed.first_[contrast] = first;
    packed.first_panel_[contrast] = panel_count;
    first += packed.counts_[contrast];
    panel_count += (packed.counts_[contrast] + kPanelColumns - 1) / kPanelColumns;
  }
  packed.feature_of_.resize(count);
  packed.panels_.resize(panel_count);  // zero bytes: what empty columns hold
  std::array<uint32_t, kContrastClassCount> filled{};
  for (uint32_t i = 0; i < count; ++i) {
    const int contrast = ContrastClassOf(features.keypoints[i].contrast_sign);
    const uint32_t ordinal = filled[contrast]++;
    packed.feature_of_[packed.first_[contrast] + ordinal] = i;
    WriteColumn(features.descriptor(i), ordinal % kPanelColumns,
                &packed.panels_[packed.first_panel_[contrast] + ordinal / kPanelColumns]);
  }
  for (int contrast = 0; contrast < kContrastClassCount; ++contrast) {
    for (uint32_t ordinal = filled[contrast]; ordinal % kPanelColumns != 0; ++ordinal) {
      packed.panels_[packed.first_panel_[contrast] + ordinal / kPanelColumns]
          .norms_squared[ordinal % kPanelColumns] = kPaddingNorm;
    }
  }
  return packed;
}

size_t PackedDescriptors::size_bytes() const {
  return sizeof(*this) + feature_of_.size() * sizeof(FeatureIndex) +
         panels_.size() * sizeof(DescriptorPanel);
}

}  // namespace veduta
