// SPDX-License-Identifier: Apache-2.0
#pragma once
// Takes one photograph of a scene.

#include <cstdint>
#include <string>
#include <vector>

#include "storage/base/status.h"
#include "storage/base/transform.h"
#include "storage/model/camera.h"
#include "tools/render/street/scene.h"

namespace veduta::street {

struct StreetCamera {
  std::string name;
  CameraModel model;
  Rigid3 cam_from_world;  // metres
};

struct RenderOptions {
  double noise_sigma = 0;    // [0, 64] grey levels, after the tone curve
  double blur_sigma_px = 0;  // [0, 20] of the lens, on light
  double exposure_stops =
      0;  // [0, 4]; exposure drawn from +-this, red and blue from +-a quarter of it
  int supersample =
      1;  // [1, 8]; 1: four rays where surfaces meet, one elsewhere; n: n x n everywhere
  bool depth = false;
  uint64_t seed = 1;  // of noise and exposure

  Status Check() const;  // the first violated bound, named with its value
};

struct StreetPhoto {
  uint32_t width_px = 0, height_px = 0;
  std::vector<uint8_t> rgb;  // [height x width x 3]
  std::vector<float> depth;  // [height x width] along the camera's z at the pixel's centre, m; 0:
                             // sky. If asked for.
};

// Renders `camera`'s view: perspective with the radial distortion of its model. Deterministic in
// its arguments on every machine as far as Embree finds the same first hits. Thread-safe. A
// 1024x768 photo takes some 0.1 s of a core and 25 MB of scratch. kInvalidArgument on bad options
// or a camera without rays.
Result<StreetPhoto> RenderPhoto(const Scene& scene, const StreetCamera& camera,
                                const RenderOptions& options);

}  // namespace veduta::street
