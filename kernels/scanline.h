// SPDX-License-Identifier: Apache-2.0
#pragma once
// Scanline optimisation: the plane of each pixel from its own costs and its neighbours'
// (Hirschmueller 2008, section 2.2).

#include "kernels/device.h"
#include "kernels/plane_choice.h"
#include "kernels/sweep_problem.h"
#include "storage/base/status.h"
#include "storage/base/thread_pool.h"

namespace veduta {

// Along each of eight directions, L(p, k) = C(p, k) + min(m(q, k), m(q, k -+ 1) + penalty_small),
// where q is p's predecessor and m(q, k) = min(L(q, k) - min_i L(q, i), penalty_large(|I_p -
// I_q|)); then the plane of the least sum. In integers throughout: the same bits on the device and,
// where it is null, in C++ on the pool.
//
// O(pixels * planes) time. Memory: 2 bytes for each pixel and plane, besides the volume.
// Thread-safe.
// kInvalidArgument if sizes do not fit, kIoError from the device; kCancelled after a stop request,
// which is looked at for each direction on the device, and for each line of pixels in C++.
Result<PlaneChoice> ChoosePlanes(const CostVolume& volume, const GrayView& key,
                                 const ScanlineOptions& options, Device* device, ThreadPool& pool,
                                 const std::stop_token& stop = {});

// SweepPlanes and ChoosePlanes, without the volume leaving the device.
Result<PlaneChoice> SweepAndChoose(const SweepProblem& problem, const ScanlineOptions& options,
                                   Device* device, ThreadPool& pool,
                                   const std::stop_token& stop = {});

}  // namespace veduta
