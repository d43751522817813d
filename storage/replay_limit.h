// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <rocksdb/wal_filter.h>

#include <cstdint>
#include <memory>

namespace veduta {

// Has RocksDB replay its log up to and with the write of this number, and nothing behind it. Its
// own recovery passes over a block of zeros in the log as if nothing had been there.
std::unique_ptr<rocksdb::WalFilter> MakeReplayLimit(uint64_t last_sequence);

}  // namespace veduta
