// SPDX-License-Identifier: Apache-2.0
#pragma once
// A photo ready to give colours: light instead of sRGB, its exposure evened out, at several sizes.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "storage/base/status.h"
#include "storage/model/view.h"

namespace veduta {

// sRGB (IEC 61966-2-1) to light in [0, 1], and back: rounded, clamped.
float LightFromSrgb(uint8_t value);
uint8_t SrgbFromLight(float light);

// Immutable; safe to share between threads.
class ColorView final {
 public:
  // view  with rgb. gain multiplies the light of each channel (exposure.h), (1, 1, 1) for none.
  // 8 bytes and about 10 ns for each pixel. kInvalidArgument if sizes do not fit, or a gain, a
  // focal length or the pose is not finite and positive.
  static Result<ColorView> Make(const View& view, const Eigen::Vector3f& gain);

  ImageId image() const { return image_; }
  const ViewGeometry& geometry() const { return geometry_; }
  const Eigen::Vector3d& center() const { return center_; }
  const Eigen::Vector3f& gain() const { return gain_; }

  struct Sample {
    Eigen::Vector3f light;  // with the gain applied; may exceed 1
    bool is_clipped =
        false;  // a channel of the photo itself is at its end: the light is a bound only
    bool is_filled = false;  // the photo is filled there, and the light says nothing
  };
  // The light around x_px (inside the photo), averaged over about `size_px` pixels across (>= 1:
  // bilinear between the pixels of the level of the pyramid next below).
  Sample At(const Eigen::Vector2d& x_px, double size_px) const;

 private:
  struct Level {
    uint32_t width_px, height_px;
    std::vector<uint16_t> light;  // [height x width x 3], 65535: 1
    std::vector<uint8_t> filled;  // [height x width], as in View
  };

  ColorView() = default;
  // Where any of the four pixels that a coarser one is the mean of is filled.
  static std::vector<uint8_t> CoarserFilled(const Level& fine);

  ImageId image_;
  ViewGeometry geometry_;
  Eigen::Vector3d center_;
  Eigen::Vector3f gain_;
  std::vector<Level> levels_;  // each half the size of the one before
};

}  // namespace veduta
