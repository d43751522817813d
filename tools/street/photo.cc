// SPDX-License-Identifier: Apache-2.0
#include "tools/street/photo.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "fusion/surface/denormals_off.h"
#include "tools/street/shader.h"

namespace veduta::street {
namespace {

struct Offset {
  float x, y;  // px from the pixel's centre
};

// One picture in the making.
class Exposure final {
 public:
  Exposure(const Scene& scene, const RayTable& rays, const Rigid3& cam_from_world)
      : scene_(scene),
        rays_(rays),
        width_(rays.camera.width_px),
        height_(rays.camera.height_px),
        linear_(size_t{width_} * height_ * 3),
        surface_(size_t{width_} * height_) {
    const Eigen::Matrix3d r =
        cam_from_world.rotation.toRotationMatrix();  // rows: right, down, forward
    for (int k = 0; k < 3; ++k) {
      for (int c = 0; c < 3; ++c) axis_[k][c] = static_cast<float>(r(k, c));
    }
    const Eigen::Vector3d center = cam_from_world.Center();
    for (int c = 0; c < 3; ++c) in_.origin[c] = static_cast<float>(center[c]);
    pixel_angle_ = static_cast<float>(2 / (rays.camera.fx + rays.camera.fy));
  }

  // One ray through every pixel's centre. `depth` may be null.
  void TakeCenters(float* depth);
  // Replaces `pixels` by the mean of their samples at `offsets`.
  void Refine(const std::vector<uint32_t>& pixels, const std::vector<Offset>& offsets);
  // Pixels next to which another surface begins, ascending.
  std::vector<uint32_t> Edges() const;
  void Blur(double sigma_px);
  std::vector<float>& linear() { return linear_; }

 private:
  void Aim(int lane, uint32_t u, uint32_t v, Offset offset);
  void Shoot();

  const Scene& scene_;
  const RayTable& rays_;
  const ShaderKernels& shader_ = BestShaderKernels();
  const uint32_t width_, height_;
  std::vector<float> linear_;            // [height x width x 3]
  std::vector<const Surface*> surface_;  // [height x width]
  float axis_[3][3];
  float pixel_angle_;
  ShadeInput in_;
  ShadeOutput out_;
};

void Exposure::Aim(int lane, uint32_t u, uint32_t v, Offset offset) {
  const size_t i = size_t{v + 1} * rays_.stride() + u + 1;
  const size_t stride = rays_.stride();
  const float* const tx = rays_.x.data() + i;
  const float* const ty = rays_.y.data() + i;
  float x = *tx, y = *ty;
  if (offset.x != 0 || offset.y != 0) {
    x += 0.5f * (offset.x * (tx[1] - tx[-1]) + offset.y * (tx[stride] - *(tx - stride)));
    y += 0.5f * (offset.x * (ty[1] - ty[-1]) + offset.y * (ty[stride] - *(ty - stride)));
  }
  for (int c = 0; c < 3; ++c)
    in_.direction[c][lane] = axis_[0][c] * x + axis_[1][c] * y + axis_[2][c];
}

void Exposure::Shoot() {
  scene_.Trace(in_.origin, in_.direction, in_.surface);
  shader_.shade(in_, out_);
}

void Exposure::TakeCenters(float* depth) {
  in_.pixel_angle = pixel_angle_;
  for (uint32_t v0 = 0; v0 < height_; v0 += 4) {
    for (uint32_t u0 = 0; u0 < width_; u0 += 4) {
      // At the right and lower border the last pixels are repeated.
      for (int i = 0; i < kLanes; ++i) {
        Aim(i, std::min(u0 + i % 4, width_ - 1), std::min(v0 + i / 4, height_ - 1), {0, 0});
      }
      Shoot();
      for (int i = 0; i < kLanes; ++i) {
        const uint32_t u = u0 + i % 4, v = v0 + i / 4;
        if (u >= width_ || v >= height_) continue;
        const size_t at = size_t{v} * width_ + u;
        for (int c = 0; c < 3; ++c) linear_[at * 3 + c] = out_.rgb[c][i];
        surface_[at] = in_.surface[i];
        if (depth != nullptr) depth[at] = out_.depth[i];
      }
    }
  }
}

std::vector<uint32_t> Exposure::Edges() const {
  std::vector<uint8_t> edge(surface_.size());
  for (uint32_t v = 0; v < height_; ++v) {
    for (uint32_t u = 0; u < width_; ++u) {
      const size_t at = size_t{v} * width_ + u;
      if (u + 1 < width_ && surface_[at] != surface_[at + 1]) edge[at] = edge[at + 1] = 1;
      if (v + 1 < height_ && surface_[at] != surface_[at + width_])
        edge[at] = edge[at + width_] = 1;
    }
  }
  std::vector<uint32_t> pixels;
  for (size_t i = 0; i < edge.size(); ++i) {
    if (edge[i] != 0) pixels.push_back(static_cast<uint32_t>(i));
  }
  return pixels;
}

void Exposure::Refine(const std::vector<uint32_t>& pixels, const std::vector<Offset>& offsets) {
  const size_t per_pixel = offsets.size(), total = pixels.size() * per_pixel;
  const float weight = 1 / static_cast<float>(per_pixel);
  in_.pixel_angle = pixel_angle_ / std::sqrt(static_cast<float>(per_pixel));
  for (const uint32_t at : pixels) std::fill_n(linear_.begin() + size_t{at} * 3, 3, 0.0f);
  for (size_t first = 0; first < total; first += kLanes) {
    for (int i = 0; i < kLanes; ++i) {
      const size_t sample = std::min(first + i, total - 1);
      const uint32_t at = pixels[sample / per_pixel];
      Aim(i, at % width_, at / width_, offsets[sample % per_pixel]);
    }
    Shoot();
    for (size_t i = 0; i < kLanes && first + i < total; ++i) {
      const size_t at = pixels[(first + i) / per_pixel];
      for (int c = 0; c < 3; ++c) linear_[at * 3 + c] += weight * out_.rgb[c][i];
    }
  }
}

// A separable Gaussian of our own: its sums do not depend on the processor. Borders are continued.
void Exposure::Blur(double sigma_px) {
  const int radius = static_cast<int>(std::ceil(3 * sigma_px));
  std::vector<float> kernel(2 * radius + 1);
  double sum = 0;
  for (int i = -radius; i <= radius; ++i) sum += std::exp(-0.5 * i * i / (sigma_px * sigma_px));
  for (int i = -radius; i <= radius; ++i) {
    kernel[i + radius] = static_cast<float>(std::exp(-0.5 * i * i / (sigma_px * sigma_px)) / sum);
  }
  std::vector<float> other(linear_.size());
  const int64_t width = width_, height = height_;
  for (int64_t v = 0; v < height; ++v) {
    for (int i = -radius; i <= radius; ++i) {
      const float weight = kernel[i + radius];
      for (int64_t u = 0; u < width; ++u) {
        const int64_t from = (v * width + std::clamp<int64_t>(u + i, 0, width - 1)) * 3;
        for (int c = 0; c < 3; ++c) other[(v * width + u) * 3 + c] += weight * linear_[from + c];
      }
    }
  }
  std::fill(linear_.begin(), linear_.end(), 0.0f);
  for (int64_t v = 0; v < height; ++v) {
    for (int i = -radius; i <= radius; ++i) {
      const float weight = kernel[i + radius];
      const float* const from =
          other.data() + std::clamp<int64_t>(v + i, 0, height - 1) * width * 3;
      float* const to = linear_.data() + v * width * 3;
      for (int64_t k = 0; k < width * 3; ++k) to[k] += weight * from[k];
    }
  }
}

std::vector<Offset> SampleOffsets(int supersample) {
  if (supersample == 1)
    return {{-0.125f, -0.375f}, {0.375f, -0.125f}, {0.125f, 0.375f}, {-0.375f, 0.125f}};
  std::vector<Offset> offsets;
  for (int y = 0; y < supersample; ++y) {
    for (int x = 0; x < supersample; ++x) {
      offsets.push_back({(x + 0.5f) / supersample - 0.5f, (y + 0.5f) / supersample - 0.5f});
    }
  }
  return offsets;
}

}  // namespace

Status RenderOptions::Check() const {
  const auto check = [](const char* name, double value, double low, double high) {
    if (value >= low && value <= high) return Status();
    return Status::InvalidArgument(std::string(name) + " " + std::to_string(value) +
                                   " is outside [" + std::to_string(low) + ", " +
                                   std::to_string(high) + "]");
  };
  VEDUTA_RETURN_IF_ERROR(check("noise sigma", noise_sigma, 0, 64));
  VEDUTA_RETURN_IF_ERROR(check("blur sigma", blur_sigma_px, 0, 20));
  VEDUTA_RETURN_IF_ERROR(check("exposure stops", exposure_stops, 0, 4));
  return check("supersampling", supersample, 1, 8);
}

Result<StreetPhoto> RenderPhoto(const Scene& scene, const StreetCamera& camera,
                                const RenderOptions& options) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  VEDUTA_ASSIGN_OR_RETURN(const std::shared_ptr<const RayTable> rays, scene.Rays(camera.model));
  if (!camera.cam_from_world.translation.allFinite() ||
      !camera.cam_from_world.rotation.coeffs().allFinite()) {
    return Status::InvalidArgument("the pose of " + camera.name + " is not finite");
  }
  const DenormalsOff denormals_off;
  StreetPhoto photo;
  photo.width_px = camera.model.width_px;
  photo.height_px = camera.model.height_px;
  const uint32_t count = photo.width_px * photo.height_px;
  if (options.depth) photo.depth.resize(count);
  const auto exposure = std::make_unique<Exposure>(scene, *rays, camera.cam_from_world);
  exposure->TakeCenters(options.depth ? photo.depth.data() : nullptr);
  std::vector<uint32_t> pixels;
  if (options.supersample == 1) {
    pixels = exposure->Edges();
  } else {
    pixels.resize(count);
    for (uint32_t i = 0; i < count; ++i) pixels[i] = i;
  }
  exposure->Refine(pixels, SampleOffsets(options.supersample));
  if (options.blur_sigma_px > 0.05) exposure->Blur(options.blur_sigma_px);

  SeededRandom random(MixSeed(options.seed, 1));
  const auto draw = [&](double stops) {
    return static_cast<float>(std::exp2(stops * (2 * random.Unit() - 1)));
  };
  const float gain = draw(options.exposure_stops);
  photo.rgb.resize(size_t{count} * 3);
  ToneInput tone = {};
  tone.linear = exposure->linear().data();
  tone.out = photo.rgb.data();
  tone.count = count;
  tone.gain[0] = gain * draw(options.exposure_stops / 4);
  tone.gain[1] = gain;
  tone.gain[2] = gain * draw(options.exposure_stops / 4);
  tone.noise_sigma = static_cast<float>(options.noise_sigma);
  tone.seed = static_cast<uint32_t>(random.Next());
  BestShaderKernels().tone(tone);
  return photo;
}

}  // namespace veduta::street
