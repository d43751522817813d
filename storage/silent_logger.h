// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <rocksdb/env.h>

namespace veduta {

// RocksDB's log is for its own developers; a reader must not leave files behind.
class SilentLogger final : public rocksdb::Logger {
 public:
  using rocksdb::Logger::Logv;
  void Logv(const char* /*format*/, va_list /*arguments*/) override {}
};

}  // namespace veduta
