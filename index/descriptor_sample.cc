// SPDX-License-Identifier: Apache-2.0
#include "index/descriptor_sample.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <tuple>
#include <utility>

#include "index/center_kernels.h"
#include "storage/base/content_hash.h"
#include "storage/base/status.h"

namespace veduta {
namespace {

constexpr size_t kCountMin = 1024;  // descriptors that there is room for at first; by hand

}  // namespace

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
      Grow();
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

// Makes room for one more: twice as much as before, but never more than the whole sample takes.
void DescriptorSample::Grow() {
  if (kept_.size() < kept_.capacity() && bytes_.size() < bytes_.capacity()) return;
  const size_t count = std::min(count_max_, std::max<size_t>(kCountMin, 2 * kept_.size()));
  kept_.reserve(count);
  bytes_.reserve(count * kCenterSize);
}

std::vector<uint8_t> DescriptorSample::Take() {
  std::sort(kept_.begin(), kept_.end());
  // Sorts the descriptors in their place, along the cycles of the permutation: i wants what lies at
  // kept_[i].slot.
  uint8_t first[kCenterSize];
  for (size_t start = 0; start < kept_.size(); ++start) {
    std::memcpy(first, &bytes_[start * kCenterSize], kCenterSize);
    size_t to = start;
    while (kept_[to].slot != to) {
      const size_t from = std::exchange(kept_[to].slot, static_cast<uint32_t>(to));
      const uint8_t* const source = from == start ? first : &bytes_[from * kCenterSize];
      std::memcpy(&bytes_[to * kCenterSize], source, kCenterSize);
      to = from;
    }
  }
  kept_ = {};
  seen_count_ = 0;
  return std::exchange(bytes_, {});
}

}  // namespace veduta
