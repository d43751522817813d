// SPDX-License-Identifier: Apache-2.0
#pragma once
// Records of the dense pass with every field set, for the tests of storage/.

#include "storage/model/dense.h"
#include "tests/storage/samples.h"

namespace veduta {

inline constexpr ReconstructionId kCity{3};

inline Rigid3 SamplePose(double turn) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(turn, Eigen::Vector3d(1, 2, 3).normalized())),
          {turn, -turn, 2 * turn}};
}

inline DepthRecord SampleDepth(uint32_t image) {
  DepthRecord d;
  d.image = ImageId(image);
  d.reconstruction = kCity;
  d.version = 0xFEDCBA9876543210u + image;
  d.geometry_version = 77;
  d.width_px = 8, d.height_px = 4;
  d.fx = 7, d.fy = 7.5, d.cx = 3.5, d.cy = 1.5;
  d.cam_from_world = SamplePose(0.3);
  d.depth_near = 0.5, d.depth_far = 20;
  d.sensors = {{ImageId(9), SamplePose(0.1)}, {ImageId(2), SamplePose(0.2)}};
  d.known_count = 30;
  d.checked_version = 5;
  d.gain = {1, 0.9f, 1.1f};
  return d;
}

inline CheckedDepthRecord SampleChecked(uint32_t image, uint64_t version) {
  CheckedDepthRecord d;
  d.image = ImageId(image);
  d.reconstruction = kCity;
  d.version = version;
  d.width_px = 8, d.height_px = 4;
  d.fx = 7, d.fy = 7.5, d.cx = 3.5, d.cy = 1.5;
  d.cam_from_world = SamplePose(0.4);
  d.depth_near = 0.5, d.depth_far = 20;
  d.known_count = 28;
  d.neighbors = {{ImageId(9), 0, 4}, {ImageId(2), 0, 3}};
  d.blocks = {{{-2, 5, 1}, 9}, {{-2, 5, 2}, 1}, {{4, -1, 0}, 70}};
  return d;
}

inline DepthPixels SamplePixels() {
  DepthPixels pixels;
  for (uint16_t i = 0; i < 32; ++i) {
    pixels.codes.push_back(static_cast<uint16_t>(i * 2000));
    pixels.confidence.push_back(static_cast<uint8_t>(i));
  }
  return pixels;
}

inline TileRecord SampleTile(GridPlace place) {
  return {kCity,
          place,
          0x8000000000000005u,
          {{ImageId(1), 0, 9}, {ImageId(2), 0, 3}, {ImageId(2), 0, 4}},
          1,
          7,
          6,
          2,
          3,
          4,
          500,
          300};
}

}  // namespace veduta
