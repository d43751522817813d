// SPDX-License-Identifier: Apache-2.0
#include "index/vocabulary_tree.h"

#include <algorithm>
#include <cstring>
#include <string>

#include "storage/base/content_hash.h"

namespace veduta {
namespace {

constexpr char kMagic[8] = {'V', 'E', 'D', 'U', 'V', 'O', 'C', 'A'};
constexpr uint32_t kVersion = 1;
constexpr size_t kHeaderSize = 32, kHashSize = 32;
constexpr size_t kBatch = 32;  // descriptors that descend side by side; chosen by hand

void AppendNumber(std::vector<uint8_t>* bytes, uint64_t value, size_t size) {
  for (size_t i = 0; i < size; ++i) bytes->push_back(static_cast<uint8_t>(value >> (8 * i)));
}

uint64_t ReadNumber(const uint8_t* bytes, size_t size) {
  uint64_t value = 0;
  for (size_t i = 0; i < size; ++i) value |= static_cast<uint64_t>(bytes[i]) << (8 * i);
  return value;
}

Status NotATree(const std::string& why) {
  return Status::InvalidArgument("not a vocabulary tree: " + why);
}

// Checks the invariants of vocabulary_tree.h; *depth is the number of levels.
Status CheckParts(const VocabularyView& parts, uint32_t* depth) {
  if (parts.branch < kVocabularyBranchMin || parts.branch > kVocabularyBranchMax) {
    return NotATree("branch " + std::to_string(parts.branch) + " is outside [2, 64]");
  }
  const size_t center_count = parts.child_is_node.size();
  if (parts.centers.size() != center_count * kCenterSize) {
    return NotATree(std::to_string(parts.centers.size()) + " bytes for " +
                    std::to_string(center_count) + " centres");
  }
  // Breadth first, so the nodes of a level are a range [begin, end), and their children make the
  // next.
  size_t begin = 0, end = 1, center = 0;
  for (*depth = 0; begin < end; ++*depth) {
    if (*depth == kVocabularyDepthMax)
      return NotATree("deeper than " + std::to_string(kVocabularyDepthMax) + " levels");
    if (end > parts.child_counts.size()) return NotATree("a child leads to a missing node");
    size_t next_end = end;
    for (size_t node = begin; node < end; ++node) {
      const size_t count = parts.child_counts[node];
      if (count < 1 || count > parts.branch || count > center_count - center) {
        return NotATree("node " + std::to_string(node) + " has " + std::to_string(count) +
                        " children");
      }
      for (size_t i = 0; i < count; ++i, ++center) {
        if (parts.child_is_node[center] > 1)
          return NotATree("child " + std::to_string(center) + " is of no known kind");
        next_end += parts.child_is_node[center];
      }
    }
    begin = end;
    end = next_end;
  }
  if (end != parts.child_counts.size()) return NotATree("a node has no parent");
  if (center != center_count) return NotATree("a centre has no parent");
  return Status::Ok();
}

}  // namespace

size_t VocabularyTree::LinesOf(uint32_t child_count) {
  return (1 + 2 * child_count + kWordsOfLine - 1) / kWordsOfLine + 2 * child_count;
}

VocabularyTree::NodeView VocabularyTree::NodeAt(size_t line) const {
  const int32_t* words = reinterpret_cast<const int32_t*>(lines_.data()) + line * kWordsOfLine;
  const uint32_t count = static_cast<uint32_t>(words[0]);
  const int32_t* centers = words + (LinesOf(count) - 2 * count) * kWordsOfLine;
  return {count, words + 1, words + 1 + count, reinterpret_cast<const uint8_t*>(centers)};
}

Result<VocabularyTree> VocabularyTree::FromParts(const VocabularyView& parts) {
  VocabularyTree tree;
  VEDUTA_RETURN_IF_ERROR(CheckParts(parts, &tree.info_.depth));
  tree.info_.branch = parts.branch;
  tree.info_.training_size = parts.training_size;
  std::vector<size_t> starts;  // the line of each interior node
  starts.reserve(parts.child_counts.size());
  size_t line_count = 0;
  for (const uint8_t count : parts.child_counts) {
    starts.push_back(line_count);
    line_count += LinesOf(count);
  }
  if (line_count > INT32_MAX || parts.child_is_node.size() > INT32_MAX)
    return NotATree("too large");
  tree.lines_.resize(line_count);
  size_t center = 0, next_node = 1;
  for (size_t node = 0; node < starts.size(); ++node) {
    const uint32_t count = parts.child_counts[node];
    uint8_t* const start =
        reinterpret_cast<uint8_t*>(tree.lines_.data()) + starts[node] * sizeof(Line);
    std::vector<int32_t> header(1 + 2 * count);
    header[0] = static_cast<int32_t>(count);
    for (uint32_t i = 0; i < count; ++i, ++center) {
      header[1 + i] = CenterBias(parts.centers.data() + center * kCenterSize);
      header[1 + count + i] = parts.child_is_node[center] != 0
                                  ? static_cast<int32_t>(starts[next_node++])
                                  : ~static_cast<int32_t>(tree.info_.leaf_count++);
    }
    std::memcpy(start, header.data(), header.size() * sizeof(int32_t));
    const size_t center_bytes = static_cast<size_t>(count) * kCenterSize;
    std::memcpy(start + LinesOf(count) * sizeof(Line) - center_bytes,
                parts.centers.data() + (center - count) * kCenterSize, center_bytes);
  }
  return tree;
}

Result<VocabularyTree> VocabularyTree::Parse(std::span<const uint8_t> bytes) {
  if (bytes.size() < kHeaderSize + kHashSize) {
    return Status::Corruption("vocabulary: " + std::to_string(bytes.size()) +
                              " bytes are too few for a header");
  }
  if (std::memcmp(bytes.data(), kMagic, sizeof(kMagic)) != 0)
    return Status::Corruption("vocabulary: wrong magic");
  const uint64_t version = ReadNumber(&bytes[8], 4);
  if (version != kVersion) {
    return Status::Corruption("vocabulary: format version " + std::to_string(version) +
                              ", this program reads " + std::to_string(kVersion));
  }
  const uint64_t node_count = ReadNumber(&bytes[24], 4), center_count = ReadNumber(&bytes[28], 4);
  const uint64_t size = kHeaderSize + node_count + center_count * (1 + kCenterSize) + kHashSize;
  if (size != bytes.size()) {
    return Status::Corruption("vocabulary: " + std::to_string(bytes.size()) +
                              " bytes where its counts say " + std::to_string(size));
  }
  const std::span<const uint8_t> content = bytes.first(bytes.size() - kHashSize);
  if (std::memcmp(HashContent(content).bytes.data(), bytes.data() + content.size(), kHashSize) !=
      0) {
    return Status::Corruption("vocabulary: its checksum does not match its content");
  }
  const VocabularyView parts{static_cast<uint32_t>(ReadNumber(&bytes[12], 4)),
                             ReadNumber(&bytes[16], 8), content.subspan(kHeaderSize, node_count),
                             content.subspan(kHeaderSize + node_count, center_count),
                             content.subspan(kHeaderSize + node_count + center_count)};
  Result<VocabularyTree> tree = FromParts(parts);
  if (!tree.ok()) return Status::Corruption("vocabulary: " + tree.status().message());
  return tree;
}

std::vector<uint8_t> VocabularyTree::Serialize() const {
  VocabularyParts parts;
  for (size_t line = 0; line < lines_.size();) {  // nodes lie breadth first
    const NodeView node = NodeAt(line);
    parts.child_counts.push_back(static_cast<uint8_t>(node.count));
    for (uint32_t i = 0; i < node.count; ++i)
      parts.child_is_node.push_back(node.children[i] >= 0 ? 1 : 0);
    parts.centers.insert(parts.centers.end(), node.centers,
                         node.centers + size_t{node.count} * kCenterSize);
    line += LinesOf(node.count);
  }
  std::vector<uint8_t> bytes(kMagic, kMagic + sizeof(kMagic));
  bytes.reserve(kHeaderSize + parts.child_counts.size() + parts.child_is_node.size() +
                parts.centers.size() + kHashSize);
  AppendNumber(&bytes, kVersion, 4);
  AppendNumber(&bytes, info_.branch, 4);
  AppendNumber(&bytes, info_.training_size, 8);
  AppendNumber(&bytes, parts.child_counts.size(), 4);
  AppendNumber(&bytes, parts.child_is_node.size(), 4);
  bytes.insert(bytes.end(), parts.child_counts.begin(), parts.child_counts.end());
  bytes.insert(bytes.end(), parts.child_is_node.begin(), parts.child_is_node.end());
  bytes.insert(bytes.end(), parts.centers.begin(), parts.centers.end());
  const ContentHash hash = HashContent(bytes);
  bytes.insert(bytes.end(), hash.bytes.begin(), hash.bytes.end());
  return bytes;
}

WordId VocabularyTree::Quantize(std::span<const uint8_t, kCenterSize> descriptor) const {
  return QuantizeAll(descriptor).front();
}

void VocabularyTree::Prefetch(size_t line) const {
  // Most nodes are full. To fetch a line too many costs less than to look at the count of children,
  // which is not in the cache yet.
  const size_t end = std::min(line + LinesOf(std::min(info_.branch, 16u)), lines_.size());
  for (; line < end; ++line) __builtin_prefetch(&lines_[line]);
}

std::vector<WordId> VocabularyTree::QuantizeAll(std::span<const uint8_t> descriptors,
                                                const CenterKernels& kernels) const {
  VEDUTA_CHECK(descriptors.size() % kCenterSize == 0,
               std::to_string(descriptors.size()) + " bytes of descriptors");
  const size_t n = descriptors.size() / kCenterSize;
  std::vector<WordId> words(n);
  for (size_t begin = 0; begin < n; begin += kBatch) {
    const size_t size = std::min(kBatch, n - begin);
    int32_t at[kBatch] = {};  // line of the node that each stands at, or ~word
    for (bool descending = true; descending;) {
      descending = false;
      for (size_t i = 0; i < size; ++i) {
        if (at[i] < 0) continue;
        const NodeView node = NodeAt(static_cast<size_t>(at[i]));
        int32_t score;
        at[i] = node.children[kernels.nearest(descriptors.data() + (begin + i) * kCenterSize,
                                              node.centers, node.biases, node.count, &score)];
        if (at[i] < 0) continue;
        descending = true;
        Prefetch(static_cast<size_t>(at[i]));
      }
    }
    for (size_t i = 0; i < size; ++i) words[begin + i] = static_cast<WordId>(~at[i]);
  }
  return words;
}

std::vector<WordId> DistinctWords(std::span<const WordId> words) {
  std::vector<WordId> distinct(words.begin(), words.end());
  std::sort(distinct.begin(), distinct.end());
  distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
  return distinct;
}

}  // namespace veduta
