// SPDX-License-Identifier: Apache-2.0
#pragma once
// Depth maps against truth.

#include <string>
#include <vector>

#include "fusion/depth/depth_estimation.h"
#include "storage/base/status.h"

namespace veduta {

struct BenchmarkSetting {
  DepthOptions depth;
  Device* device = nullptr;
  ThreadPool* pool = nullptr;
  std::string pictures;  // a folder for PNGs to look at; empty: none
};

// Rectified pairs of `folder` (Cones, Cloth3, Wood2, Aloe), beside OpenCV's StereoSGBM. Prints a
// line a pair.
Status RunPairs(const std::string& folder, bool with_sgbm, const BenchmarkSetting& setting);
// A rendered street as veduta-street writes it with --depth. Prints the figures of `key_count` key
// views.
Status RunStreet(const std::string& folder, uint32_t key_count, const BenchmarkSetting& setting);

// Cost and scanline optimisation of one triple at 512x384, on the device and in C++. Prints times
// and limits.
Status TimeSweep(const BenchmarkSetting& setting);

}  // namespace veduta
