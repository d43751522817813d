// SPDX-License-Identifier: Apache-2.0
#include "cli/service/memory_division.h"

#include <string>

namespace veduta {
namespace {

constexpr uint64_t kLeastBytes = 1ull << 30;

}  // namespace

Result<MemoryDivision> DivideMemory(uint64_t bytes) {
  if (bytes < kLeastBytes) {
    return Status::InvalidArgument(
        "the memory is " + std::to_string(bytes) + " bytes, and must be 1 GiB (" +
        std::to_string(kLeastBytes) +
        ") or more: a photo that comes may have 128 MiB, and preparing one takes 256 MiB");
  }
  const uint64_t part = bytes / 16;
  MemoryDivision division;
  division.prepare_memory_bytes = 4 * part;
  division.block_cache_bytes = 2 * part;
  division.feature_cache_bytes = 2 * part;
  division.undistort_cache_bytes = part;
  division.surface_cache_bytes = part;
  division.bodies_bytes_max = 2 * part;
  division.answers_bytes_max = 2 * part;
  division.rpc_bytes_max = 2 * part;
  return division;
}

}  // namespace veduta
