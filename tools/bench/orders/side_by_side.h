// SPDX-License-Identifier: Apache-2.0
#pragma once
// Runs orders side by side, each in a process of its own: one that aborts is told as that and ends
// no other.

#include <functional>
#include <span>

#include "tools/bench/orders/order_run.h"

namespace veduta::orders {

// Runs one order in a folder of its own; called in a new process.
using OrderRunner = std::function<OrderRun(const PhotoOrder& order, const std::string& folder)>;

struct SideBySideOptions {
  uint32_t jobs = 1;  // [1, 1024]; orders at the same time
  bool keep = false;  // the folders of the runs
};

// Runs all orders, at most `jobs` at a time, and calls `done` with each run as it ends. The caller
// must have no other thread: processes are made by fork. kIoError where that fails.
Status RunSideBySide(std::span<const PhotoOrder> orders, const SideBySideOptions& options,
                     const OrderRunner& runner,
                     const std::function<void(size_t index, const OrderRun& run)>& done);

}  // namespace veduta::orders
