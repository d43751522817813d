// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/color_view.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace veduta {
namespace {

constexpr float kScale = 65535;
constexpr uint8_t kClipped =
    253;  // from here on a channel may have ended: JPEG moves it by a few levels

double DecodeSrgb(double value) {
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

struct Tables {
  std::array<float, 256> light;     // of each value
  std::array<float, 255> boundary;  // light at which value i becomes i + 1

  Tables() {
    for (int i = 0; i < 256; ++i) light[i] = static_cast<float>(DecodeSrgb(i / 255.0));
    for (int i = 0; i < 255; ++i) boundary[i] = static_cast<float>(DecodeSrgb((i + 0.5) / 255.0));
  }
};

const Tables& SrgbTables() {
  static const Tables tables;
  return tables;
}

}  // namespace

float LightFromSrgb(uint8_t value) {
  return SrgbTables().light[value];
}

uint8_t SrgbFromLight(float light) {
  const auto& boundary = SrgbTables().boundary;
  return static_cast<uint8_t>(std::upper_bound(boundary.begin(), boundary.end(), light) -
                              boundary.begin());
}

Result<ColorView> ColorView::Make(const View& view, const Eigen::Vector3f& gain) {
  const ViewGeometry& g = view.geometry;
  const auto wrong = [&](const std::string& text) {
    return Status::InvalidArgument("photo " + std::to_string(view.image.value) + ": " + text);
  };
  if (g.width_px < 1 || g.height_px < 1 ||
      view.rgb.size() != size_t{g.width_px} * g.height_px * 3) {
    return wrong(std::to_string(view.rgb.size()) + " bytes of colour for " +
                 std::to_string(g.width_px) + "x" + std::to_string(g.height_px) + " pixels");
  }
  if (!gain.allFinite() || gain.minCoeff() <= 0) return wrong("a gain is not finite and positive");
  if (!view.filled.empty() && view.filled.size() != size_t{g.width_px} * g.height_px)
    return wrong(std::to_string(view.filled.size()) + " bytes say where it is filled");
  const Pinhole& c = g.camera;
  if (!(c.fx > 0 && c.fy > 0) || !std::isfinite(c.fx + c.fy + c.cx + c.cy))
    return wrong("impossible intrinsics");
  if (!g.cam_from_world.translation.allFinite() ||
      !g.cam_from_world.rotation.coeffs().allFinite()) {
    return wrong("the pose is not finite");
  }
  ColorView made;
  made.image_ = view.image;
  made.geometry_ = g;
  made.center_ = g.cam_from_world.Center();
  made.gain_ = gain;
  std::array<uint16_t, 256> table;
  for (int i = 0; i < 256; ++i) {
    table[i] = static_cast<uint16_t>(std::lround(LightFromSrgb(static_cast<uint8_t>(i)) * kScale));
  }
  Level first = {g.width_px, g.height_px, std::vector<uint16_t>(view.rgb.size()), view.filled};
  std::transform(view.rgb.begin(), view.rgb.end(), first.light.begin(),
                 [&](uint8_t value) { return table[value]; });
  made.levels_.push_back(std::move(first));
  while (std::min(made.levels_.back().width_px, made.levels_.back().height_px) >= 4) {
    const Level& fine = made.levels_.back();
    Level coarse = {fine.width_px / 2, fine.height_px / 2, {}, CoarserFilled(fine)};
    coarse.light.resize(size_t{coarse.width_px} * coarse.height_px * 3);
    const size_t stride = size_t{fine.width_px} * 3;
    for (uint32_t y = 0; y < coarse.height_px; ++y) {
      const uint16_t* const in = fine.light.data() + 2 * y * stride;
      uint16_t* const out = coarse.light.data() + size_t{y} * coarse.width_px * 3;
      for (uint32_t i = 0; i < coarse.width_px * 3; ++i) {
        const size_t at = i / 3 * 6 + i % 3;
        out[i] = static_cast<uint16_t>(
            (in[at] + in[at + 3] + in[at + stride] + in[at + stride + 3] + 2u) / 4);
      }
    }
    made.levels_.push_back(std::move(coarse));
  }
  return made;
}

std::vector<uint8_t> ColorView::CoarserFilled(const Level& fine) {
  std::vector<uint8_t> coarse;
  if (fine.filled.empty()) return coarse;
  const size_t width = fine.width_px;
  for (size_t y = 0; y + 1 < fine.height_px; y += 2) {
    for (size_t x = 0; x + 1 < width; x += 2) {
      const uint8_t* const at = fine.filled.data() + y * width + x;
      coarse.push_back(at[0] | at[1] | at[width] | at[width + 1]);
    }
  }
  return coarse;
}

ColorView::Sample ColorView::At(const Eigen::Vector2d& x_px, double size_px) const {
  size_t l = 0;
  double scale = 1;
  while (l + 1 < levels_.size() && size_px >= 2 * scale) ++l, scale *= 2;
  const Level& level = levels_[l];
  // The centre of pixel (0, 0) of a level lies in the middle of the pixels it is made of.
  const auto place = [&](double x, uint32_t size, uint32_t* low, float* rest) {
    const double at = std::clamp((x + 0.5) / scale - 0.5, 0.0, size - 1.0);
    *low = std::min(static_cast<uint32_t>(at), size >= 2 ? size - 2 : 0);
    *rest = static_cast<float>(at - *low);
  };
  uint32_t u, v;
  float a, b;
  place(x_px.x(), level.width_px, &u, &a);
  place(x_px.y(), level.height_px, &v, &b);
  const size_t right = level.width_px >= 2 ? 3 : 0,
               down = level.height_px >= 2 ? size_t{level.width_px} * 3 : 0;
  const uint16_t* const at = level.light.data() + (size_t{v} * level.width_px + u) * 3;
  static const float clipped = LightFromSrgb(kClipped) * kScale;
  Sample sample;
  for (int c = 0; c < 3; ++c) {
    const float p = at[c], q = at[c + right], r = at[c + down], s = at[c + down + right];
    const float mean = (1 - b) * ((1 - a) * p + a * q) + b * ((1 - a) * r + a * s);
    sample.is_clipped |= mean >= clipped;
    sample.light[c] = mean * gain_[c] / kScale;
  }
  if (!level.filled.empty()) {
    const uint8_t* const here = level.filled.data() + size_t{v} * level.width_px + u;
    sample.is_filled = (here[0] | here[right / 3] | here[down / 3] | here[(down + right) / 3]) != 0;
  }
  return sample;
}

}  // namespace veduta
