// SPDX-License-Identifier: Apache-2.0
#include "index/descriptor_sample.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <tuple>

#include "index/center_kernels.h"
#include "storage/base/content_hash.h"
#include "storage/base/status.h"

namespace veduta {

bool DescriptorSample::Kept::operator<(const Kept& other) const {
  return std::tie(drawn, image_seed, index) < std::tie(other.drawn, other.image_seed, other.index);
}

DescriptorSample::DescriptorSample(size_t count_max) : count_max_(count_max) {
  VEDUTA_CHECK(count_max <= UINT32_MAX, "a sample of " + std::to_string(count_max));
}

void DescriptorSample::Add(uint64_t image_seed, std::span<const uint8_t> descriptors) {
  VEDUTA_CHECK(descriptors.size() % kCenterSize == 0,
               std::to_string(descriptors.size()) + " bytes of descriptors");
  const size_t n = descriptors.size() / kCenterSize;
  seen_count_ += n;
  if (count_max_ == 0) return;
  for (size_t i = 0; i < n; ++i) {
    Kept kept{MixSeed(image_seed, i), image_seed, static_cast<uint32_t>(i),
              static_cast<uint32_t>(kept_.size())};
    const uint8_t* descriptor = descriptors.data() + i * kCenterSize;
    if (kept_.size() < count_max_) {
      bytes_.insert(bytes_.end(), descriptor, descriptor + kCenterSize);
    } else {
      if (!(kept < kept_.front())) continue;
      std::pop_heap(kept_.begin(), kept_.end());
      kept.slot = kept_.back().slot;
      kept_.pop_back();
      std::memcpy(bytes_.data() + size_t{kept.slot} * kCenterSize, descriptor, kCenterSize);
    }
    kept_.push_back(kept);
    std::push_heap(kept_.begin(), kept_.end());
  }
}

std::vector<uint8_t> DescriptorSample::Take() {
  std::sort(kept_.begin(), kept_.end());
  std::vector<uint8_t> sample(bytes_.size());
  for (size_t i = 0; i < kept_.size(); ++i) {
    std::memcpy(sample.data() + i * kCenterSize,
                bytes_.data() + size_t{kept_[i].slot} * kCenterSize, kCenterSize);
  }
  kept_.clear();
  bytes_.clear();
  seen_count_ = 0;
  return sample;
}

}  // namespace veduta
