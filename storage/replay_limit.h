// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <rocksdb/wal_filter.h>

#include <cstdint>
#include <memory>

namespace veduta {

// Has RocksDB replay its logs up to and with the write of the number last_sequence, and nothing
// behind it. Its own recovery passes over a block of zeros in the log as if nothing had been there.
// Logs with a number above last_log were begun later, by a process that has cut off what lies
// behind the limit: they are replayed.
std::unique_ptr<rocksdb::WalFilter> MakeReplayLimit(uint64_t last_sequence, uint64_t last_log);

}  // namespace veduta
