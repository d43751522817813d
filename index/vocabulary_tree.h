// SPDX-License-Identifier: Apache-2.0
#pragma once
// A tree of k-means centres that sorts SIFT descriptors into visual words (Nister and Stewenius
// 2006): a descriptor goes from the root to the nearest child until it reaches a leaf, and the
// leaf's number is its word.
//
// Invariants: interior nodes are numbered breadth first, the root is 0; each has 1 to `branch`
// children, each child a centre of 128 bytes that leads to a leaf or to an interior node; leaves
// are words 0..leaf_count-1 in the order of their centres. Distances are exact integers, so words
// do not depend on the processor.

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "index/center_kernels.h"
#include "storage/base/ids.h"
#include "storage/base/status.h"

namespace veduta {

inline constexpr uint32_t kVocabularyBranchMin = 2;
inline constexpr uint32_t kVocabularyBranchMax = kCenterCountMax;
inline constexpr uint32_t kVocabularyDepthMax = 7;  // levels of centres below the root; R8

struct VocabularyInfo {
  uint32_t branch = 0;         // children of a node at most, [2, 64]
  uint32_t depth = 0;          // levels of centres, [1, 7]
  uint32_t leaf_count = 0;     // words
  uint64_t training_size = 0;  // descriptors that it was trained on

  bool operator==(const VocabularyInfo&) const = default;
};

// A tree laid out for building and storing, whose bytes are somebody else's.
struct VocabularyView {
  uint32_t branch = 0;
  uint64_t training_size = 0;
  std::span<const uint8_t> child_counts, child_is_node, centers;  // as VocabularyParts has them
};

// The same with its bytes.
struct VocabularyParts {
  operator VocabularyView() const {  // NOLINT: as a vector is a span
    return {branch, training_size, child_counts, child_is_node, centers};
  }

  uint32_t branch = 0;
  uint64_t training_size = 0;
  std::vector<uint8_t> child_counts;   // [interior nodes], breadth first
  std::vector<uint8_t> child_is_node;  // [centres], in the order of their parents: 1 leads to an
                                       // interior node, 0 is a leaf
  std::vector<uint8_t> centers;        // [centres x 128] row-major
};

// Immutable; thread-safe.
class VocabularyTree final {
 public:
  // Takes the tree's own bytes and hardly more. kInvalidArgument, naming the invariant, when the
  // parts do not make a tree.
  static Result<VocabularyTree> FromParts(const VocabularyView& parts);

  // The inverse of Serialize. kCorruption with the reason for anything else: wrong magic, version
  // or checksum, a truncated or overlong input, numbers that make no tree. Allocates at most a few
  // times bytes.size().
  static Result<VocabularyTree> Parse(std::span<const uint8_t> bytes);

  // Little-endian, in this order:
  //   magic "VEDUVOCA"
  //   version u32 = 1
  //   branch u32
  //   training_size u64
  //   count of interior nodes u32
  //   count of centers u32
  //   child_counts u8 [interior nodes]
  //   child_is_node u8 [centers]
  //   centers u8 [centers x 128]
  //   SHA-256 of all before, 32 bytes
  // Equal trees give equal bytes.
  std::vector<uint8_t> Serialize() const;

  const VocabularyInfo& info() const { return info_; }

  // The word of one descriptor; at every node the nearest centre in squared L2, ties to the first.
  WordId Quantize(std::span<const uint8_t, kCenterSize> descriptor) const;

  // The words of descriptors [n x 128], in their order. Faster than one by one: several descend at
  // a time, and the next nodes are fetched ahead. Each takes 0.2 us per level on one core where the
  // tree exceeds the cache. Aborts if the size is no multiple of 128. `kernels` is for tests: all
  // kernels give the same words.
  std::vector<WordId> QuantizeAll(std::span<const uint8_t> descriptors,
                                  const CenterKernels& kernels = BestCenterKernels()) const;

 private:
  // A node is a run of lines: its header (child count, biases of the children, where each leads),
  // padded to whole lines, and then the children's centres, two lines each. `children[i]` >= 0 is
  // the line where that node starts, < 0 is ~word.
  static constexpr uint32_t kWordsOfLine = 16;
  struct alignas(64) Line {
    int32_t words[kWordsOfLine];
  };
  struct NodeView {
    uint32_t count;
    const int32_t* biases;
    const int32_t* children;
    const uint8_t* centers;
  };

  VocabularyTree() = default;
  static size_t LinesOf(uint32_t child_count);
  NodeView NodeAt(size_t line) const;
  void Prefetch(size_t line) const;

  VocabularyInfo info_;
  std::vector<Line> lines_;
};

// The distinct words among those of one image, ascending: what postings and scores are made of.
std::vector<WordId> DistinctWords(std::span<const WordId> words);

}  // namespace veduta
