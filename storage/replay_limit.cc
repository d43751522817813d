// SPDX-License-Identifier: Apache-2.0
#include "storage/replay_limit.h"

#include <rocksdb/write_batch.h>

#include "storage/log_format.h"

namespace veduta {
namespace {

class ReplayLimit final : public rocksdb::WalFilter {
 public:
  ReplayLimit(uint64_t last_sequence, uint64_t last_log)
      : last_sequence_(last_sequence), last_log_(last_log) {}
  const char* Name() const override { return "veduta.ReplayLimit"; }
  WalProcessingOption LogRecordFound(unsigned long long log, const std::string& /*file*/,
                                     const rocksdb::WriteBatch& batch,
                                     rocksdb::WriteBatch* /*changed*/,
                                     bool* /*is_changed*/) override {
    const bool is_behind =
        log <= last_log_ && LittleEndianAt<uint64_t>(batch.Data(), 0) > last_sequence_;
    return is_behind ? WalProcessingOption::kStopReplay : WalProcessingOption::kContinueProcessing;
  }

 private:
  const uint64_t last_sequence_, last_log_;
};

}  // namespace

std::unique_ptr<rocksdb::WalFilter> MakeReplayLimit(uint64_t last_sequence, uint64_t last_log) {
  return std::make_unique<ReplayLimit>(last_sequence, last_log);
}

}  // namespace veduta
