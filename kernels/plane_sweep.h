// SPDX-License-Identifier: Apache-2.0
#pragma once
// What it costs to see a key view's pixel on a plane: census and gradient of the key view against
// the warped sensor views'.

#include <stop_token>

#include "kernels/device.h"
#include "kernels/sweep_problem.h"
#include "storage/base/status.h"
#include "storage/base/thread_pool.h"

namespace veduta {

// The cost of every plane at every pixel. A sensor view is warped by bilinear interpolation in
// fixed point (8 bits of fraction). Its cost at a pixel is 2 c + min(g, 32), at most 100. c counts
// those of the 34 neighbors in a window of 7 x 5 that are darker than the center in one view and
// not in the other (census; Zabih and Woodfill 1994); g is the difference of the gradients, |dx| +
// |dy| by central differences. A change of brightness changes neither; a change of contrast does
// not change c. With one or two sensor views the better cost counts, with more the mean of the best
// two of those that see the point, so that a view whose sight is blocked does no harm. Outside of
// an image its edge is repeated.
//
// Computed on the device, or in C++ on the pool where the device is null, with the same bits.
// O(pixels * planes * sensors) time. Thread-safe. kInvalidArgument as Check says, kIoError from the
// device; kCancelled after a stop request, which is looked at every 16 planes on the device, and
// every plane of 48 rows in C++.
Result<CostVolume> SweepPlanes(const SweepProblem& problem, Device* device, ThreadPool& pool,
                               const std::stop_token& stop = {});

}  // namespace veduta
