// SPDX-License-Identifier: Apache-2.0
#pragma once
// Depth maps as they are stored: 16 bits of inverse depth a pixel, even in what stereo can tell
// apart.

#include "fusion/depth/depth_range.h"
#include "storage/base/status.h"
#include "storage/dense.h"
#include "storage/model/depth_map.h"

namespace veduta {

// Part of the version of every depth map: raise it whenever a change of the code changes what
// EncodeDepth returns (tests/fusion/pass/pinned_bytes_test.cc notices).
inline constexpr uint32_t kDepthCodesVersion = 1;

// Depths outside of the range become its ends; the error is below (1/near - 1/far) / 131068 of
// inverse depth.
DepthPixels EncodeDepth(const DepthMap& map, const DepthRange& range);

// kCorruption unless there are width * height pixels. Decode(Encode(Decode(x))) gives the bytes of
// Decode(x).
Result<DepthMap> DecodeDepth(const DepthPixels& pixels, uint32_t width_px, uint32_t height_px,
                             const DepthRange& range);

}  // namespace veduta
