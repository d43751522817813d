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

// Appends an operand's ids; false when it is no array of ids.
bool AppendIds(const rocksdb::Slice& value, std::vector<uint32_t>* ids) {
  if (value.size() % sizeof(uint32_t) != 0) return false;
  const size_t before = ids->size();
  ids->resize(before + value.size() / sizeof(uint32_t));
  if (!value.empty()) std::memcpy(ids->data() + before, value.data(), value.size());
  return true;
}

// Images are mostly added in ascending order: then the concatenation is the union already.
void SortUnique(std::vector<uint32_t>* ids) {
  if (std::adjacent_find(ids->begin(), ids->end(), std::greater_equal<>()) == ids->end()) return;
  std::sort(ids->begin(), ids->end());
  ids->erase(std::unique(ids->begin(), ids->end()), ids->end());
}

void Assign(const std::vector<uint32_t>& ids, std::string* value) {
  value->assign(reinterpret_cast<const char*>(ids.data()), ids.size() * sizeof(uint32_t));
}

// Takes all operands of a key at once: two by two would copy a long list once an operand.
class PostingsMerge final : public rocksdb::MergeOperator {
 public:
  const char* Name() const override { return "veduta.postings"; }

  bool FullMergeV2(const MergeOperationInput& input, MergeOperationOutput* output) const override {
    std::vector<uint32_t> ids;
    if (input.existing_value != nullptr && !AppendIds(*input.existing_value, &ids)) return false;
    for (const rocksdb::Slice& operand : input.operand_list) {
      if (!AppendIds(operand, &ids)) return false;
    }
    SortUnique(&ids);
    Assign(ids, &output->new_value);
    return true;
  }

  bool PartialMergeMulti(const rocksdb::Slice& /*key*/, const std::deque<rocksdb::Slice>& operands,
                         std::string* new_value, rocksdb::Logger* /*logger*/) const override {
    std::vector<uint32_t> ids;
    for (const rocksdb::Slice& operand : operands) {
      if (!AppendIds(operand, &ids)) return false;
    }
    SortUnique(&ids);
    Assign(ids, new_value);
    return true;
  }
};

}  // namespace

std::shared_ptr<rocksdb::MergeOperator> MakePostingsMerge() {
  return std::make_shared<PostingsMerge>();
}

}  // namespace veduta
