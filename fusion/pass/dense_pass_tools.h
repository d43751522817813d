// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the dense pass works with.

#include <cstdint>
#include <functional>
#include <stop_token>
#include <string_view>

#include "engine/writer/writer.h"
#include "fusion/pass/view_loader.h"
#include "storage/base/thread_pool.h"

namespace veduta {

class Device;

// Told after each piece: the stage, how many pieces it has looked at, and how many there are.
using DenseProgress = std::function<void(std::string_view stage, size_t done, size_t total)>;

struct DensePassTools {
  Writer& writer;
  ThreadPool& pool;
  Device* device = nullptr;  // null: C++ on the pool. The result is the same, bit for bit.
  DenseProgress progress;    // may be empty
  std::stop_token stop;
  ViewTools views = {};
  // Of what a stage keeps: one half of views or depth maps, the other of meshes that rays are cast
  // at. Chosen by hand.
  uint64_t cache_bytes = 512ull << 20;
};

}  // namespace veduta
