// SPDX-License-Identifier: Apache-2.0
// The merge operator of posting lists. The first byte says how the rest divides into a value and
// its operands.
#include <rocksdb/merge_operator.h>

#include <algorithm>
#include <deque>
#include <optional>

#include "storage/postings_merge.h"
#include "tools/fuzz/fuzz_target.h"

namespace veduta::fuzz {

std::vector<std::string> Seeds() {
  return {std::string("\x04\1\0\0\0\2\0\0\0\3\0\0\0\3\0\0\0", 17),
          std::string("\x04\1\0\0\0\2\0\0\0\0\0\0\0\1\0\0\0", 17),  // 1 is taken out
          std::string("\x08\7\0\0\0\1\0\0\0\2\0\0\0\2\0\0\0", 17), std::string("\x03\1\2\3\4", 5)};
}

namespace {

// Whether the bytes are ascending ids, each once, as what is read is checked to be.
bool IsUnion(const std::string& value) {
  std::vector<uint32_t> ids(value.size() / sizeof(uint32_t));
  std::copy_n(value.data(), ids.size() * sizeof(uint32_t), reinterpret_cast<char*>(ids.data()));
  return value.size() % sizeof(uint32_t) == 0 &&
         std::adjacent_find(ids.begin(), ids.end(), std::greater_equal<>()) == ids.end();
}

// The list that a value and its operands make; none where they are no lists.
std::optional<std::string> Merged(const rocksdb::MergeOperator& merge, const rocksdb::Slice* value,
                                  const std::vector<rocksdb::Slice>& operands) {
  std::string list;
  rocksdb::Slice ignored;
  rocksdb::MergeOperator::MergeOperationOutput output(list, ignored);
  const rocksdb::MergeOperator::MergeOperationInput input("word", value, operands, nullptr);
  if (!merge.FullMergeV2(input, &output)) return std::nullopt;
  return list;
}

}  // namespace
}  // namespace veduta::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using veduta::fuzz::Expect;
  if (size < 2) return 0;
  const size_t step = 1 + data[0] % 64;
  std::deque<rocksdb::Slice> pieces;
  std::vector<rocksdb::Slice> operands;
  for (size_t at = 1; at < size; at += step)
    pieces.emplace_back(reinterpret_cast<const char*>(data + at), std::min(step, size - at));
  operands.assign(pieces.begin() + 1, pieces.end());
  const auto merge = veduta::MakePostingsMerge();
  std::string partial;
  const auto at_once = veduta::fuzz::Merged(*merge, &pieces.front(), operands);
  const bool is_partial = merge->PartialMergeMulti("word", pieces, &partial, nullptr);
  Expect(at_once.has_value() == is_partial, "operands that merge at once merge in parts");
  if (!at_once) return 0;
  Expect(veduta::fuzz::IsUnion(*at_once), "a merged list ascends");
  Expect(veduta::fuzz::Merged(*merge, nullptr, {rocksdb::Slice(partial)}) == at_once,
         "merging in parts gives the same list");
  return 0;
}
