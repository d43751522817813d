// SPDX-License-Identifier: Apache-2.0
#include "storage/database_options.h"

#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// Below, RocksDB's cache (16 shards, each with whole blocks of 4 KiB) keeps hardly anything; above,
// somebody has taken another unit for bytes. Both were chosen by hand; not measured.
constexpr uint64_t kBlockCacheBytesMin = 1ull << 20;
constexpr uint64_t kBlockCacheBytesMax = 1ull << 40;

}  // namespace

Status DatabaseOptions::Check() const {
  if (create && read_only)
    return Status::InvalidArgument(
        "create and read_only are both set: a database cannot be created for reading only");
  return OptionBounds()
      .Between("block_cache_bytes", static_cast<double>(block_cache_bytes),
               static_cast<double>(kBlockCacheBytesMin), static_cast<double>(kBlockCacheBytesMax))
      .status();
}

}  // namespace veduta
