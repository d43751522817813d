// SPDX-License-Identifier: Apache-2.0
#include "storage/postings_merge.h"

#include <rocksdb/merge_operator.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <deque>
#include <string>
#include <vector>

namespace veduta {
namespace {

// What operands say: ids to unite with, and ids to take out, which an operand has behind a 0. An
// image that is taken out is never added again, since ids are not used twice. So taking out counts
// whatever the order, and operands may be combined in any grouping.
struct Change {
  std::vector<uint32_t> added, removed;

  // False when the value is no array of ids.
  bool Take(const rocksdb::Slice& value) {
    if (value.size() % sizeof(uint32_t) != 0) return false;
    std::vector<uint32_t> ids(value.size() / sizeof(uint32_t));
    if (!value.empty()) std::memcpy(ids.data(), value.data(), value.size());
    const auto zero = std::find(ids.begin(), ids.end(), 0u);
    added.insert(added.end(), ids.begin(), zero);
    if (zero != ids.end()) removed.insert(removed.end(), zero + 1, ids.end());
    return true;
  }

  void Normalize() {
    SortUnique(&added);
    if (removed.empty()) return;
    SortUnique(&removed);
    std::erase_if(
        added, [&](uint32_t id) { return std::binary_search(removed.begin(), removed.end(), id); });
  }

 private:
  // Images are mostly added in ascending order: then the concatenation is the union already.
  static void SortUnique(std::vector<uint32_t>* ids) {
    if (std::adjacent_find(ids->begin(), ids->end(), std::greater_equal<>()) == ids->end()) return;
    std::sort(ids->begin(), ids->end());
    ids->erase(std::unique(ids->begin(), ids->end()), ids->end());
  }
};

void Append(const std::vector<uint32_t>& ids, std::string* value) {
  value->append(reinterpret_cast<const char*>(ids.data()), ids.size() * sizeof(uint32_t));
}

// Takes all operands of a key at once: two by two would copy a long list once an operand.
class PostingsMerge final : public rocksdb::MergeOperator {
 public:
  const char* Name() const override { return "veduta.postings"; }

  bool FullMergeV2(const MergeOperationInput& input, MergeOperationOutput* output) const override {
    Change change;
    if (input.existing_value != nullptr && !change.Take(*input.existing_value)) return false;
    for (const rocksdb::Slice& operand : input.operand_list) {
      if (!change.Take(operand)) return false;
    }
    change.Normalize();
    output->new_value.clear();
    Append(change.added, &output->new_value);
    return true;
  }

  bool PartialMergeMulti(const rocksdb::Slice& /*key*/, const std::deque<rocksdb::Slice>& operands,
                         std::string* new_value, rocksdb::Logger* /*logger*/) const override {
    Change change;
    for (const rocksdb::Slice& operand : operands) {
      if (!change.Take(operand)) return false;
    }
    change.Normalize();
    new_value->clear();
    Append(change.added, new_value);
    if (change.removed.empty()) return true;
    Append({0}, new_value);
    Append(change.removed, new_value);
    return true;
  }
};

}  // namespace

std::shared_ptr<rocksdb::MergeOperator> MakePostingsMerge() {
  return std::make_shared<PostingsMerge>();
}

}  // namespace veduta
