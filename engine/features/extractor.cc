// SPDX-License-Identifier: Apache-2.0
#include "engine/features/extractor.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <new>
#include <numeric>
#include <string>
#include <tuple>
#include <vector>

#include "engine/features/descriptor.h"
#include "engine/features/exact_math.h"
#include "engine/features/extraction.h"
#include "engine/features/orientation.h"
#include "engine/features/scale_space.h"

namespace veduta {

struct FeatureScratch::Memory {
  ScaleSpace scale_space;
  std::vector<Extremum> extrema;
};

FeatureScratch::FeatureScratch() : memory_(std::make_unique<Memory>()) {}
FeatureScratch::~FeatureScratch() = default;

namespace {

// Chosen by hand; not measured. The largest area bounds memory.
constexpr int kImageSizeMin = 16;
constexpr int64_t kImageAreaMax = int64_t{1} << 26;

Status CheckImage(const GrayView& image) {
  const std::string size = std::to_string(image.width_px) + "x" + std::to_string(image.height_px);
  if (image.width_px < kImageSizeMin || image.height_px < kImageSizeMin) {
    return Status::InvalidArgument("the image is " + size + ", features need 16 px each way");
  }
  if (int64_t{image.width_px} * image.height_px > kImageAreaMax) {
    return Status::InvalidArgument("the image is " + size + ", more than 2^26 px");
  }
  if (image.pixels == nullptr || image.stride_bytes < static_cast<size_t>(image.width_px)) {
    return Status::InvalidArgument("the image has no pixels or a stride below its width");
  }
  return Status::Ok();
}

// A keypoint with one direction, and where its octave has it.
struct Oriented {
  Keypoint keypoint;
  int octave = 0, level = 0;
  double x = 0, y = 0, sigma = 0;  // px of the octave
};

bool IsStronger(const Oriented& a, const Oriented& b) {
  const auto key = [](const Oriented& o) {
    return std::tuple(-o.keypoint.response, o.keypoint.y_px, o.keypoint.x_px, o.keypoint.scale_px,
                      o.keypoint.angle_deg);
  };
  return key(a) < key(b);
}

Oriented Place(const Extremum& extremum, const FeatureOptions& options) {
  Oriented result;
  result.octave = extremum.octave;
  result.level = extremum.level;
  result.x = extremum.x;
  result.y = extremum.y;
  result.sigma =
      options.sigma * ExactExp2((extremum.level + extremum.level_offset) / kScalesPerOctave);
  const double scale =
      std::ldexp(options.upsample ? 0.5 : 1.0, extremum.octave);  // photo px per px of the octave
  const double shift = options.upsample ? -0.25 : 0.0;            // see BaseRows
  result.keypoint.x_px = static_cast<float>(result.x * scale + shift);
  result.keypoint.y_px = static_cast<float>(result.y * scale + shift);
  result.keypoint.scale_px = static_cast<float>(result.sigma * scale);
  result.keypoint.response = static_cast<float>(std::fabs(extremum.contrast));
  result.keypoint.contrast_sign = extremum.contrast > 0 ? 1 : -1;
  return result;
}

// The order of memory: keypoints whose patches lie near each other follow each other, so that a
// patch is read while its rows are still in the cache.
bool IsBeforeInMemory(const Oriented& a, const Oriented& b) {
  constexpr int kStripRows = 16;  // chosen by hand; not measured
  const auto key = [](const Oriented& o) {
    return std::tuple(o.octave, o.level, static_cast<int>(o.y) / kStripRows, o.x, o.y,
                      o.keypoint.angle_deg);
  };
  return key(a) < key(b);
}

// The strongest keypoints, each once. Every keypoint gives a feature at least, so the weaker ones
// cannot give one of the feature_count_max strongest features.
std::vector<Oriented> SelectKeypoints(const std::vector<Extremum>& extrema,
                                      const FeatureOptions& options) {
  std::vector<Oriented> keypoints;
  keypoints.reserve(extrema.size());
  for (const Extremum& extremum : extrema) keypoints.push_back(Place(extremum, options));
  std::sort(keypoints.begin(), keypoints.end(), IsStronger);
  // Extrema found at neighbouring samples may refine to the same point.
  const auto is_same = [](const Oriented& a, const Oriented& b) {
    return a.keypoint == b.keypoint;
  };
  keypoints.erase(std::unique(keypoints.begin(), keypoints.end(), is_same), keypoints.end());
  if (keypoints.size() > options.feature_count_max) keypoints.resize(options.feature_count_max);
  return keypoints;
}

// Reads one value of every cache line that a keypoint's orientation and descriptor will read. The
// planes are larger than the caches. The processor fetches many lines side by side when the reads
// do not depend on each other and no branches lie between them, as here: this saved a quarter of
// the time of description. Prefetch instructions saved nothing: the processor drops them where it
// has not translated the address yet.
void TouchWindow(const GrayPlane& plane, const Oriented& keypoint) {
  constexpr double kReachSigma = 11.0;  // to the corners of the rotated grid
  constexpr ptrdiff_t kLineValues = 32;
  const int reach = static_cast<int>(kReachSigma * keypoint.sigma) + 1;
  const int x = static_cast<int>(keypoint.x), y = static_cast<int>(keypoint.y);
  const int top = std::max(0, y - reach), bottom = std::min(plane.height - 1, y + reach);
  const int left = std::max(0, x - reach), right = std::min(plane.width - 1, x + reach);
  for (int row = top; row <= bottom; ++row) {
    const volatile int16_t* p = plane.pixels + row * plane.stride;
    for (ptrdiff_t i = left; i < right; i += kLineValues) (void)p[i];
    (void)p[right];
  }
}

struct Described {
  std::vector<Oriented> features;
  std::vector<uint8_t> descriptors;
};

// Directions and descriptors of all keypoints, in the order in which their patches lie in memory.
Described Describe(std::vector<Oriented> keypoints, const ScaleSpace& scale_space,
                   const SiftKernels& kernels) {
  std::sort(keypoints.begin(), keypoints.end(), IsBeforeInMemory);
  const DescriptorMaker maker(kernels);
  Described result;
  result.features.reserve(keypoints.size() + keypoints.size() / 2);
  result.descriptors.reserve((keypoints.size() + keypoints.size() / 2) * kDescriptorSize);
  for (const Oriented& keypoint : keypoints) {
    const GrayPlane plane = scale_space.Plane(keypoint.octave, keypoint.level);
    TouchWindow(plane, keypoint);
    const Directions directions =
        FindDirections(kernels, plane, keypoint.x, keypoint.y, keypoint.sigma);
    for (int i = 0; i < directions.count; ++i) {
      result.features.push_back(keypoint);
      result.features.back().keypoint.angle_deg = directions.angle_deg[i];
      result.descriptors.resize(result.descriptors.size() + kDescriptorSize);
      maker.Make(plane, keypoint.x, keypoint.y, keypoint.sigma, directions.angle_deg[i],
                 result.descriptors.data() + result.descriptors.size() - kDescriptorSize);
    }
  }
  return result;
}

// The strongest features, strongest first.
Features Rank(const Described& described, size_t count_max) {
  std::vector<uint32_t> order(described.features.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&described](uint32_t a, uint32_t b) {
    return IsStronger(described.features[a], described.features[b]);
  });
  order.resize(std::min(order.size(), count_max));
  Features result;
  result.keypoints.reserve(order.size());
  result.descriptors.reserve(order.size() * kDescriptorSize);
  for (uint32_t i : order) {
    result.keypoints.push_back(described.features[i].keypoint);
    const uint8_t* descriptor =
        described.descriptors.data() + static_cast<size_t>(i) * kDescriptorSize;
    result.descriptors.insert(result.descriptors.end(), descriptor, descriptor + kDescriptorSize);
  }
  return result;
}

class StageClock {
 public:
  // Milliseconds since the last call or construction.
  double Lap() {
    const auto now = std::chrono::steady_clock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - last_).count();
    last_ = now;
    return ms;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

Features Extract(const SiftKernels& kernels, const GrayView& image, const FeatureOptions& options,
                 FeatureScratch::Memory* memory, ExtractionTimes* times) {
  StageClock clock;
  memory->extrema.clear();
  memory->scale_space.Build(image, options, kernels, &memory->extrema);
  times->scale_space_ms = clock.Lap();
  const Described described =
      Describe(SelectKeypoints(memory->extrema, options), memory->scale_space, kernels);
  Features result = Rank(described, options.feature_count_max);
  times->description_ms = clock.Lap();
  return result;
}

}  // namespace

Result<Features> ExtractFeaturesWith(const SiftKernels& kernels, const GrayView& image,
                                     const FeatureOptions& options, FeatureScratch* scratch,
                                     ExtractionTimes* times) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  VEDUTA_RETURN_IF_ERROR(CheckImage(image));
  ExtractionTimes unused;
  try {
    if (scratch != nullptr)
      return Extract(kernels, image, options, &scratch->memory(), times ? times : &unused);
    FeatureScratch own;
    return Extract(kernels, image, options, &own.memory(), times ? times : &unused);
  } catch (const std::bad_alloc&) {
    return Status::NoMemory("there is not enough memory for the features of a photo of " +
                            std::to_string(image.width_px) + "x" + std::to_string(image.height_px) +
                            " px");
  }
}

Result<Features> ExtractFeatures(const GrayView& image, const FeatureOptions& options,
                                 FeatureScratch* scratch) {
  return ExtractFeaturesWith(BestSiftKernels(), image, options, scratch, nullptr);
}

}  // namespace veduta
