// SPDX-License-Identifier: Apache-2.0
#pragma once
// A uniform sample of the descriptors of many images, for training, in bounded memory.

#include <cstdint>
#include <span>
#include <vector>

namespace veduta {

// Every descriptor draws a number from its image's content and its own index; those with the lowest
// numbers are kept. So the sample depends on which images were added and not on their order. Not
// thread-safe.
class DescriptorSample final {
 public:
  // Keeps at most count_max descriptors. Each takes 128 bytes and 32 of bookkeeping, allocated as
  // descriptors come: up to 1.5 times that while the memory grows.
  explicit DescriptorSample(size_t count_max);

  // descriptors [n x 128] of one image; image_seed is its ContentHash::Seed(). Add an image once.
  // Aborts if the size is no multiple of 128.
  void Add(uint64_t image_seed, std::span<const uint8_t> descriptors);

  size_t count() const { return kept_.size(); }
  uint64_t seen_count() const { return seen_count_; }

  // The sample, [count x 128], in the order of the numbers drawn. This object is empty afterwards,
  // and holds no memory.
  std::vector<uint8_t> Take();

 private:
  struct Kept {
    uint64_t drawn, image_seed;
    uint32_t index;  // within the image
    uint32_t slot;   // where the bytes are
    bool operator<(const Kept& other) const;
  };

  void Grow();

  size_t count_max_;
  uint64_t seen_count_ = 0;
  std::vector<Kept> kept_;  // a heap, the greatest on top
  std::vector<uint8_t> bytes_;
};

}  // namespace veduta
