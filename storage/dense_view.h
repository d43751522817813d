// SPDX-License-Identifier: Apache-2.0
#pragma once
// The dense pass's side of a Snapshot and of a Transaction, over RocksDB.

#include <memory>

#include "storage/dense.h"
#include "storage/value_reader.h"
#include "storage/write_buffer.h"

namespace veduta {

// Reads by `reader`, which outlives it.
std::unique_ptr<const DenseReader> MakeDenseReader(const ValueReader& reader);
// Writes into the buffer that `buffer` names at each call.
std::unique_ptr<DenseWriter> MakeDenseWriter(std::function<WriteBuffer&()> buffer);

}  // namespace veduta
