// SPDX-License-Identifier: Apache-2.0
#pragma once
// The merge operator of `postings`: a value is an ascending array of little-endian u32 image ids,
// each once, and so is every operand; the result is the union. Union is associative and
// commutative, so RocksDB may combine operands at any time, in any grouping, without changing what
// is read.

#include <memory>

namespace rocksdb {
class MergeOperator;
}

namespace veduta {

// Thread-safe and stateless. A value or operand whose size is no multiple of 4 makes the merge
// fail, which RocksDB reports as corruption.
std::shared_ptr<rocksdb::MergeOperator> MakePostingsMerge();

}  // namespace veduta
