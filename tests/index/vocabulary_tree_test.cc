// SPDX-License-Identifier: Apache-2.0
// Goal: a word is the leaf that plain descent finds, on every instruction set; a stored tree
//   comes back the same; no bytes, however wrong, give anything but kCorruption.
// Method: trees built by hand and by training against a descent written over the parts;
//   truncations and bit flips of a stored tree at every byte, and damaged content under a
//   checksum made right again.
#include "index/vocabulary_tree.h"

#include <gtest/gtest.h>

#include <cstring>
#include <string>

#include "index/vocabulary_trainer.h"
#include "storage/base/cpu_isa.h"
#include "tests/index/synthetic_descriptors.h"

namespace veduta {
namespace {

// Root with three children: leaf 0, a node, leaf 1; the node has two leaves, 2 and 3.
VocabularyParts SmallParts() {
  VocabularyParts parts;
  parts.branch = 3;
  parts.training_size = 77;
  parts.child_counts = {3, 2};
  parts.child_is_node = {0, 1, 0, 0, 0};
  for (const uint8_t level : {0, 100, 200, 90, 110})
    parts.centers.insert(parts.centers.end(), kCenterSize, level);
  return parts;
}

VocabularyParts RandomParts(uint32_t branch, uint64_t seed) {
  SeededRandom random(seed);
  VocabularyParts parts;
  parts.branch = branch;
  std::vector<uint32_t> levels{1};  // of each interior node's children
  for (size_t node = 0; node < levels.size(); ++node) {
    const uint32_t count = 1 + random.Below(branch);
    parts.child_counts.push_back(static_cast<uint8_t>(count));
    for (uint32_t i = 0; i < count; ++i) {
      const bool is_node = levels[node] < kVocabularyDepthMax && levels.size() < 30 &&
                           (i == 0 || random.Below(2) == 0);
      parts.child_is_node.push_back(is_node ? 1 : 0);
      if (is_node) levels.push_back(levels[node] + 1);
      Append(&parts.centers, RandomDescriptor(random));
    }
  }
  return parts;
}

// Descends by the definition, over the parts.
std::vector<WordId> PlainWords(const VocabularyParts& parts,
                               const std::vector<uint8_t>& descriptors) {
  std::vector<size_t> first_center(parts.child_counts.size());
  std::vector<size_t> target(parts.child_is_node.size());  // node or word
  size_t center = 0, next_node = 1, next_word = 0;
  for (size_t node = 0; node < parts.child_counts.size(); ++node) {
    first_center[node] = center;
    for (size_t i = 0; i < parts.child_counts[node]; ++i, ++center) {
      target[center] = parts.child_is_node[center] != 0 ? next_node++ : next_word++;
    }
  }
  std::vector<WordId> words;
  for (size_t row = 0; row < descriptors.size(); row += kCenterSize) {
    size_t node = 0;
    for (;;) {
      int64_t best_distance = INT64_MAX;
      size_t best = 0;
      for (size_t c = first_center[node]; c < first_center[node] + parts.child_counts[node]; ++c) {
        int64_t distance = 0;
        for (size_t j = 0; j < kCenterSize; ++j) {
          const int64_t d = int64_t{descriptors[row + j]} - parts.centers[c * kCenterSize + j];
          distance += d * d;
        }
        if (distance < best_distance) {
          best_distance = distance;
          best = c;
        }
      }
      node = target[best];
      if (parts.child_is_node[best] == 0) break;
    }
    words.push_back(static_cast<WordId>(node));
  }
  return words;
}

TEST(VocabularyTree, NumbersLeavesInOrder) {
  const VocabularyTree tree = VocabularyTree::FromParts(SmallParts()).value();
  EXPECT_EQ(tree.info(), (VocabularyInfo{3, 2, 4, 77}));
  const uint8_t levels[] = {10, 250, 92, 130, 50, 150};
  const WordId words[] = {0, 1, 2, 3, 0, 3};  // 50 and 150 lie halfway: the first centre wins
  std::vector<uint8_t> descriptors;
  for (size_t i = 0; i < std::size(levels); ++i) {
    const std::vector<uint8_t> descriptor(kCenterSize, levels[i]);
    EXPECT_EQ(tree.Quantize(std::span<const uint8_t, kCenterSize>(descriptor)), words[i])
        << int{levels[i]};
    Append(&descriptors, descriptor);
  }
  EXPECT_EQ(tree.QuantizeAll(descriptors), std::vector<WordId>(std::begin(words), std::end(words)));
  EXPECT_TRUE(tree.QuantizeAll({}).empty());
}

TEST(VocabularyTree, DescendsAsDefinedOnEveryInstructionSet) {
  for (const uint32_t branch : {2u, 3u, 10u, 16u, 17u, 64u}) {
    const VocabularyParts parts = RandomParts(branch, branch);
    const VocabularyTree tree = VocabularyTree::FromParts(parts).value();
    const std::vector<uint8_t> descriptors = RandomDescriptors(101, MixSeed(branch, 5));
    const std::vector<WordId> expected = PlainWords(parts, descriptors);
    for (const CpuIsa isa : kCpuIsas) {
      const CenterKernels* kernels = FindCenterKernels(isa);
      if (kernels == nullptr) continue;
      EXPECT_EQ(tree.QuantizeAll(descriptors, *kernels), expected)
          << CpuIsaName(isa) << ", branch " << branch;
    }
    for (size_t i = 0; i < expected.size(); i += 7) {
      const std::span<const uint8_t, kCenterSize> one(&descriptors[i * kCenterSize],
                                                      size_t{kCenterSize});
      EXPECT_EQ(tree.Quantize(one), expected[i]);
    }
  }
}

TEST(VocabularyTree, RefusesPartsThatMakeNoTree) {
  const auto why = [](auto&& change) {
    VocabularyParts parts = SmallParts();
    change(parts);
    const Result<VocabularyTree> tree = VocabularyTree::FromParts(parts);
    EXPECT_FALSE(tree.ok());
    EXPECT_EQ(tree.status().code(), StatusCode::kInvalidArgument);
    return tree.status().message();
  };
  EXPECT_NE(why([](auto& p) { p.branch = 1; }).find("branch 1"), std::string::npos);
  EXPECT_NE(why([](auto& p) { p.branch = 65; }).find("branch 65"), std::string::npos);
  EXPECT_NE(why([](auto& p) { p.branch = 2; }).find("3 children"), std::string::npos);
  EXPECT_NE(why([](auto& p) { p.centers.pop_back(); }).find("bytes for 5 centres"),
            std::string::npos);
  EXPECT_NE(why([](auto& p) { p.child_counts = {3, 0}; }).find("0 children"), std::string::npos);
  EXPECT_NE(why([](auto& p) { p.child_counts = {3, 3}; }).find("3 children"), std::string::npos);
  EXPECT_NE(why([](auto& p) { p.child_counts = {3}; }).find("missing node"), std::string::npos);
  EXPECT_NE(why([](auto& p) { p.child_counts = {}; }).find("missing node"), std::string::npos);
  EXPECT_NE(why([](auto& p) {
              p.child_counts = {3, 1};
            }).find("centre has no parent"),
            std::string::npos);
  EXPECT_NE(why([](auto& p) { p.child_is_node[1] = 0; }).find("node has no parent"),
            std::string::npos);
  EXPECT_NE(why([](auto& p) { p.child_is_node[1] = 2; }).find("no known kind"), std::string::npos);
  const auto chain = [](size_t levels) {
    VocabularyParts parts;
    parts.branch = 2;
    parts.child_counts.assign(levels, 1);
    parts.child_is_node.assign(levels, 1);
    parts.child_is_node.back() = 0;
    parts.centers.resize(levels * kCenterSize);
    return VocabularyTree::FromParts(parts);
  };
  EXPECT_EQ(chain(7).value().info().depth, 7u);
  EXPECT_NE(chain(8).status().message().find("deeper"), std::string::npos);
}

TEST(VocabularyTree, ComesBackFromBytes) {
  for (const uint32_t branch : {2u, 10u, 64u}) {
    VocabularyParts parts = RandomParts(branch, MixSeed(branch, 9));
    parts.training_size = (uint64_t{1} << 40) + branch;
    const VocabularyTree tree = VocabularyTree::FromParts(parts).value();
    const std::vector<uint8_t> bytes = tree.Serialize();
    const Result<VocabularyTree> parsed = VocabularyTree::Parse(bytes);
    ASSERT_TRUE(parsed.ok()) << parsed.status().message();
    EXPECT_EQ(parsed->info(), tree.info());
    EXPECT_EQ(parsed->Serialize(), bytes);
    const std::vector<uint8_t> descriptors = RandomDescriptors(200, branch);
    EXPECT_EQ(parsed->QuantizeAll(descriptors), tree.QuantizeAll(descriptors));
  }
}

void ExpectCorrupt(const std::vector<uint8_t>& bytes, const std::string& what) {
  // A copy of its own size, so that a sanitizer sees a read past the end.
  const std::unique_ptr<uint8_t[]> exact(new uint8_t[bytes.size()]);
  if (!bytes.empty()) std::memcpy(exact.get(), bytes.data(), bytes.size());
  const Result<VocabularyTree> tree = VocabularyTree::Parse({exact.get(), bytes.size()});
  ASSERT_FALSE(tree.ok()) << what;
  EXPECT_EQ(tree.status().code(), StatusCode::kCorruption) << what;
  EXPECT_FALSE(tree.status().message().empty());
}

TEST(VocabularyTree, RefusesDamagedBytes) {
  const std::vector<uint8_t> bytes = VocabularyTree::FromParts(SmallParts()).value().Serialize();
  for (size_t size = 0; size < bytes.size(); ++size) {
    ExpectCorrupt({bytes.begin(), bytes.begin() + static_cast<ptrdiff_t>(size)},
                  "cut at " + std::to_string(size));
  }
  for (size_t i = 0; i < bytes.size(); ++i) {
    for (int bit = 0; bit < 8; ++bit) {
      std::vector<uint8_t> flipped = bytes;
      flipped[i] ^= static_cast<uint8_t>(1 << bit);
      ExpectCorrupt(flipped, "bit " + std::to_string(bit) + " of byte " + std::to_string(i));
    }
  }
  std::vector<uint8_t> longer = bytes;
  longer.push_back(0);
  ExpectCorrupt(longer, "a byte more");
}

// Makes the checksum right for whatever stands before it.
std::vector<uint8_t> Sealed(std::vector<uint8_t> bytes) {
  const ContentHash hash = HashContent(std::span(bytes).first(bytes.size() - 32));
  std::copy(hash.bytes.begin(), hash.bytes.end(), bytes.end() - 32);
  return bytes;
}

TEST(VocabularyTree, RefusesForgedBytes) {
  const std::vector<uint8_t> bytes = VocabularyTree::FromParts(SmallParts()).value().Serialize();
  const size_t structure_end = 32 + 2 + 5;  // header, child counts, kinds
  size_t accepted = 0;
  for (size_t i = 0; i < structure_end; ++i) {
    for (int value = 0; value < 256; ++value) {
      if (bytes[i] == value) continue;
      std::vector<uint8_t> forged = bytes;
      forged[i] = static_cast<uint8_t>(value);
      const Result<VocabularyTree> tree = VocabularyTree::Parse(Sealed(forged));
      if (!tree.ok()) {
        EXPECT_EQ(tree.status().code(), StatusCode::kCorruption);
        continue;
      }
      // What is accepted is another sound tree: its words stay in range.
      ++accepted;
      for (const WordId word : tree->QuantizeAll(RandomDescriptors(20, i)))
        EXPECT_LT(word, tree->info().leaf_count);
      EXPECT_EQ(tree->Serialize(), Sealed(forged));
    }
  }
  // The low byte of branch (3 is the least that fits, 64 the most), eight bytes of training_size,
  // and the node may as well be the first or the last child; two bytes have to change for that.
  EXPECT_EQ(accepted, 61u + 8 * 255u);
  // Counts of 4 thousand million in a short input are refused before anything is allocated for
  // them.
  std::vector<uint8_t> huge = bytes;
  std::fill(huge.begin() + 24, huge.begin() + 32, uint8_t{255});
  ExpectCorrupt(Sealed(huge), "huge counts");
}

TEST(VocabularyTree, RefusesRandomBytes) {
  const std::vector<uint8_t> bytes =
      VocabularyTree::FromParts(RandomParts(10, 3)).value().Serialize();
  SeededRandom random(4);
  for (int round = 0; round < 2000; ++round) {
    std::vector<uint8_t> forged = bytes;
    const uint32_t changes = 1 + random.Below(6);
    for (uint32_t i = 0; i < changes; ++i) {
      forged[random.Below(200)] = static_cast<uint8_t>(random.Below(round % 2 == 0 ? 256 : 12));
    }
    const Result<VocabularyTree> tree = VocabularyTree::Parse(Sealed(forged));
    if (!tree.ok()) {
      EXPECT_EQ(tree.status().code(), StatusCode::kCorruption);
      continue;
    }
    for (const WordId word : tree->QuantizeAll(RandomDescriptors(5, 6)))
      EXPECT_LT(word, tree->info().leaf_count);
  }
}

TEST(VocabularyTree, DistinctWordsAscend) {
  const WordId words[] = {5, 1, 5, 9, 1, 1};
  EXPECT_EQ(DistinctWords(words), (std::vector<WordId>{1, 5, 9}));
  EXPECT_TRUE(DistinctWords({}).empty());
}

}  // namespace
}  // namespace veduta
