// SPDX-License-Identifier: Apache-2.0
// VocabularyTree::Parse on bytes as they are, and with the checksum that they should have: else
// hardly a mutation would pass it.
#include "index/vocabulary_tree.h"

#include "storage/base/content_hash.h"
#include "tools/fuzz/fuzz_target.h"

namespace veduta::fuzz {

std::vector<std::string> Seeds() {
  VocabularyParts deep;  // a root with an interior node and two leaves
  deep.branch = 3;
  deep.training_size = 500;
  deep.child_counts = {3, 2};
  deep.child_is_node = {0, 1, 0, 0, 0};
  deep.centers.resize(5 * kCenterSize);
  for (size_t i = 0; i < deep.centers.size(); ++i) deep.centers[i] = static_cast<uint8_t>(i * 7);
  std::vector<std::string> seeds;
  const auto tree = VocabularyTree::FromParts(deep);
  Expect(tree.status(), "the seed is a tree");
  std::string bytes = Text(tree->Serialize());
  seeds.push_back(bytes);
  seeds.push_back(bytes.substr(0, bytes.size() - 32));  // the checksum is added below
  return seeds;
}

}  // namespace veduta::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using veduta::fuzz::Expect;
  std::vector<uint8_t> bytes(data, data + size);
  (void)veduta::VocabularyTree::Parse(bytes).status().ok();  // may be anything
  const veduta::ContentHash hash = veduta::HashContent(bytes);
  bytes.insert(bytes.end(), hash.bytes.begin(), hash.bytes.end());
  const auto tree = veduta::VocabularyTree::Parse(bytes);
  if (!tree.ok()) return 0;
  Expect(tree->Serialize() == bytes, "a tree that is read is written as it was");
  const std::vector<uint8_t> descriptors(4 * veduta::kCenterSize, 90);
  Expect(tree->QuantizeAll(descriptors).size() == 4, "a tree has a word for every descriptor");
  return 0;
}
