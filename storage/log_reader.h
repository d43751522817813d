// SPDX-License-Identifier: Apache-2.0
#pragma once
// Reads one file of RocksDB's write-ahead log, or its manifest, which is made of the same records,
// and goes on behind what is damaged in it. RocksDB itself stops there, and does not say what
// follows.

#include <rocksdb/file_system.h>

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "storage/base/status.h"

namespace veduta {

// A run of bytes of a log: one record, or something that is none.
struct LogPiece {
  uint64_t begin_bytes = 0, end_bytes = 0;  // in the file
  bool readable = false;

  // Where it is readable:
  std::string_view record;  // its bytes, of a log for rocksdb::WriteBatch; gone when visit returns
  // Of a log, whose records are batches:
  uint64_t sequence = 0;  // of the batch's first write
  uint32_t count = 0;     // of its writes

  // Where it is not: a power cut may leave this, because the disk need not have got everything that
  // was never synced. The file ends within it, or a page of it ends in zeros, or a whole sector of
  // it is zeros.
  bool may_be_unwritten = false;
};

// Calls visit for the pieces of the log in their order. What only fills a block is no piece.
// Reads the file once, about 1 GB/s from memory, and keeps the largest batch in memory.
// kIoError where the file cannot be read, kNotFound where there is none.
Status ReadLog(rocksdb::FileSystem& file_system, const std::string& path,
               const std::function<Status(const LogPiece&)>& visit);
Status ReadManifest(rocksdb::FileSystem& file_system, const std::string& path,
                    const std::function<Status(const LogPiece&)>& visit);

}  // namespace veduta
