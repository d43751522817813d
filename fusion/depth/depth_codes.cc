// SPDX-License-Identifier: Apache-2.0
#include "fusion/depth/depth_codes.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace veduta {
namespace {

constexpr double kSteps = 65534;  // codes 1 to 65535

}  // namespace

DepthPixels EncodeDepth(const DepthMap& map, const DepthRange& range) {
  const double far = 1 / range.far, scale = kSteps / (1 / range.near - far);
  DepthPixels pixels;
  pixels.confidence = map.confidence;
  pixels.codes.reserve(map.depth.size());
  for (const float z : map.depth) {
    const double code =
        z > 0 ? 1 + std::clamp(std::round((1 / double{z} - far) * scale), 0.0, kSteps) : 0;
    pixels.codes.push_back(static_cast<uint16_t>(code));
  }
  return pixels;
}

Result<DepthMap> DecodeDepth(const DepthPixels& pixels, uint32_t width_px, uint32_t height_px,
                             const DepthRange& range) {
  const size_t count = static_cast<size_t>(width_px) * height_px;
  if (pixels.codes.size() != count || pixels.confidence.size() != count) {
    return Status::Corruption("a depth map of " + std::to_string(width_px) + "x" +
                              std::to_string(height_px) + " px has " +
                              std::to_string(pixels.codes.size()) + " depths");
  }
  const double far = 1 / range.far, step = (1 / range.near - far) / kSteps;
  DepthMap map{width_px, height_px, {}, pixels.confidence};
  map.depth.reserve(count);
  for (const uint16_t code : pixels.codes) {
    map.depth.push_back(code == 0 ? 0.0f : static_cast<float>(1 / (far + (code - 1) * step)));
  }
  return map;
}

}  // namespace veduta
