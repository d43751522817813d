// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <rocksdb/env.h>

namespace veduta {

// RocksDB's log is for its own developers; the file LOG is not written.
class SilentLogger final : public rocksdb::Logger {
 public:
  using rocksdb::Logger::Logv;
  void Logv(const char* /*format*/, va_list /*arguments*/) override {}
};

}  // namespace veduta
