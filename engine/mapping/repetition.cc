// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/repetition.h"

#include <algorithm>
#include <array>
#include <bit>
#include <compare>
#include <cstring>
#include <vector>

#include "engine/matching/contrast_class.h"
#include "engine/matching/homography.h"
#include "engine/matching/matcher_kernels.h"
#include "storage/base/content_hash.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// The strongest features of a view, by contrast class, and where they are.
struct View {
  const MapImage& image;
  std::vector<Eigen::Vector2d> x;  // normalised
  std::array<std::vector<uint32_t>, kContrastClassCount> of_class;

  View(const MapImage& of, uint32_t count_max) : image(of) {
    const size_t count = std::min<size_t>(of.features->size(), count_max);
    for (uint32_t i = 0; i < count; ++i) {
      const Keypoint& keypoint = of.features->keypoints[i];
      x.push_back(of.camera.Normalize(keypoint));
      of_class[ContrastClassOf(keypoint.contrast_sign)].push_back(i);
    }
  }
};

struct Alike {
  uint32_t distance_squared = 0;
  uint32_t feature = 0;
  auto operator<=>(const Alike&) const = default;
};

// The features of b that look most like one of a, the best first.
std::vector<Alike> FindAlike(const View& a, uint32_t feature, const View& b,
                             const RepetitionOptions& options, std::vector<uint32_t>* distances) {
  const Features& features = *a.image.features;
  const std::vector<uint32_t>& candidates =
      b.of_class[ContrastClassOf(features.keypoints[feature].contrast_sign)];
  distances->resize(candidates.size());
  BestMatcherKernels().distances(features.descriptor(feature), b.image.features->descriptors.data(),
                                 candidates.data(), candidates.size(), distances->data());
  std::vector<Alike> alike;
  for (size_t i = 0; i < candidates.size(); ++i) {
    if ((*distances)[i] < options.distance_squared_max)
      alike.push_back({(*distances)[i], candidates[i]});
  }
  const size_t count = std::min<size_t>(alike.size(), options.alike_count_max);
  std::partial_sort(alike.begin(), alike.begin() + static_cast<ptrdiff_t>(count), alike.end());
  alike.resize(count);
  return alike;
}

// Bytes of a descriptor that tell one feature from another: those of its middle are rarely 0.
constexpr size_t kLookOffset = 60;

// What two views agree upon, and what else would be as good.
struct Rivals {
  size_t agreeing = 0;                    // features of a
  std::vector<Eigen::Vector2d> x_a, x_b;  // those of them with rivals, which may be several
};

Rivals FindRivals(const View& a, const View& b, const Homography& plane,
                  const RepetitionOptions& options) {
  const double focal_px = b.image.camera.focal_px();
  Rivals rivals;
  std::vector<uint32_t> distances;
  for (uint32_t i = 0; i < a.x.size(); ++i) {
    const std::vector<Alike> alike = FindAlike(a, i, b, options, &distances);
    const auto agrees = std::find_if(alike.begin(), alike.end(), [&](const Alike& one) {
      return plane.Explains(a.x[i], b.x[one.feature], options.error_px_max / focal_px);
    });
    if (agrees == alike.end()) continue;
    ++rivals.agreeing;
    const double distance_max = options.rival_distance_factor * agrees->distance_squared;
    for (const Alike& one : alike) {
      if (one.distance_squared >= distance_max ||
          plane.Explains(a.x[i], b.x[one.feature], options.apart_px / focal_px))
        continue;
      rivals.x_a.push_back(a.x[i]);
      rivals.x_b.push_back(b.x[one.feature]);
    }
  }
  return rivals;
}

// How many features of a another homography puts elsewhere.
size_t CountRivalled(const Rivals& rivals, double distance_max, uint64_t seed,
                     const RepetitionOptions& options) {
  const Homography other =
      FindHomography(rivals.x_a, rivals.x_b, distance_max, static_cast<int>(options.samples), seed);
  size_t count = 0;
  const Eigen::Vector2d* last = nullptr;  // the rivals of a feature stand side by side
  for (size_t i = 0; i < rivals.x_a.size(); ++i) {
    if (!other.Explains(rivals.x_a[i], rivals.x_b[i], distance_max)) continue;
    if (last == nullptr || *last != rivals.x_a[i]) ++count;
    last = &rivals.x_a[i];
  }
  return count;
}

// The plane that most matches of the pair lie on.
Homography PlaneOf(const PairRecord& pair, const View& a, const View& b, double distance_max,
                   uint64_t seed) {
  std::vector<Eigen::Vector2d> x_a, x_b;
  for (const FeatureMatch& match : pair.matches) {
    x_a.push_back(a.image.camera.Normalize(a.image.features->keypoints[match.a]));
    x_b.push_back(b.image.camera.Normalize(b.image.features->keypoints[match.b]));
  }
  // Enough for a plane of a third of the matches, with a confidence of 0.99.
  return FindHomography(x_a, x_b, distance_max, /*sample_count=*/400, seed);
}

uint64_t LookOf(const View& view, uint32_t feature) {
  uint64_t look = 0;
  std::memcpy(&look, view.image.features->descriptor(feature) + kLookOffset, sizeof(look));
  return look;
}

// A value that stands for the pair and what it matches: what it shows again and again depends on
// nothing else, and on no chance.
uint64_t SeedOf(const PairRecord& pair, const View& a, const View& b) {
  uint64_t seed = MixSeed(pair.a.value, pair.b.value);
  seed = MixSeed(MixSeed(seed, a.x.size()), b.x.size());
  for (const FeatureMatch& match : pair.matches) {
    seed = MixSeed(seed, (uint64_t{match.a} << 32) + match.b);
    seed = MixSeed(seed, LookOf(a, match.a) ^ std::rotl(LookOf(b, match.b), 1));
  }
  return seed;
}

Repetition RepetitionOf(const PairRecord& pair, const View& a, const View& b, uint64_t seed,
                        const RepetitionOptions& options) {
  const double distance_max = options.error_px_max / b.image.camera.focal_px();
  const Homography plane = PlaneOf(pair, a, b, distance_max, seed);
  if (plane.inlier_count == 0) return {};
  const Rivals rivals = FindRivals(a, b, plane, options);
  return {rivals.agreeing, CountRivalled(rivals, distance_max, seed, options)};
}

}  // namespace

Status RepetitionOptions::Check() const {
  return OptionBounds()
      .Between("feature_count_max", feature_count_max, 1, 65535)
      .AtLeast("alike_count_max", alike_count_max, 1)
      .AtLeast("distance_squared_max", distance_squared_max, 1)
      .AtLeast("rival_distance_factor", rival_distance_factor, 1)
      .Above("apart_px", apart_px, 0)
      .Above("error_px_max", error_px_max, 0)
      .Between("samples", samples, 1, 1'000'000)
      .AtLeast("pair_count_max", pair_count_max, 1)
      .status();
}

double RepeatedShare(std::span<const MapImage> images, std::span<const PairRecord> pairs,
                     const RepetitionOptions& options, RepetitionMemory* memory) {
  std::vector<const PairRecord*> asked;
  for (const PairRecord& pair : pairs) asked.push_back(&pair);
  std::stable_sort(asked.begin(), asked.end(), [](const PairRecord* x, const PairRecord* y) {
    return x->matches.size() > y->matches.size();
  });
  if (asked.size() > options.pair_count_max) asked.resize(options.pair_count_max);

  std::vector<View> views;
  for (const MapImage& image : images) views.emplace_back(image, options.feature_count_max);
  const auto view_of = [&](ImageId id) -> const View& {
    return *std::find_if(views.begin(), views.end(),
                         [&](const View& view) { return view.image.id == id; });
  };
  Repetition all;
  for (const PairRecord* pair : asked) {
    const View &a = view_of(pair->a), &b = view_of(pair->b);
    const uint64_t seed = SeedOf(*pair, a, b);
    std::optional<Repetition> known;
    if (memory != nullptr) known = memory->Find(seed);
    if (!known) known = RepetitionOf(*pair, a, b, seed, options);
    if (memory != nullptr) memory->Put(seed, known, 1);
    all.agreeing += known->agreeing;
    all.rivalled += known->rivalled;
  }
  return all.agreeing == 0 ? 0
                           : static_cast<double>(all.rivalled) / static_cast<double>(all.agreeing);
}

}  // namespace veduta
