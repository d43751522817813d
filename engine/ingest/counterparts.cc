// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/counterparts.h"

#include <algorithm>
#include <cstdint>
#include <tuple>

#include "engine/camera/orientation.h"
#include "engine/camera/projection.h"

namespace veduta {
namespace {

// Chosen by hand; not measured.
constexpr float kApartPxMax = 1.5f;          // in the smaller copy
constexpr uint32_t kDifferenceMax = 62'500;  // squared, of descriptors whose length is 512

// Where all features lie, px of the smaller copy.
std::vector<Eigen::Vector2f> PlacesOf(const PictureCopy& copy, double width_px, double height_px) {
  std::vector<Eigen::Vector2f> places;
  places.reserve(copy.features.size());
  for (const Keypoint& keypoint : copy.features.keypoints) {
    const Eigen::Vector2d place = PlaceInPicture(copy, keypoint);
    places.emplace_back(place.x() * width_px, place.y() * height_px);
  }
  return places;
}

uint32_t DifferenceOf(const uint8_t* a, const uint8_t* b) {
  uint32_t sum = 0;
  for (int i = 0; i < kDescriptorSize; ++i) {
    const int32_t difference = int32_t{a[i]} - int32_t{b[i]};
    sum += static_cast<uint32_t>(difference * difference);
  }
  return sum;
}

}  // namespace

ImageSize PictureCopy::upright_size() const {
  return UprightSize({camera.width_px, camera.height_px}, orientation);
}

Eigen::Vector2d PlaceInPicture(const PictureCopy& copy, const Keypoint& keypoint) {
  const CameraModel& camera = copy.camera;
  Eigen::Vector2d px(keypoint.x_px, keypoint.y_px);
  if (IsDistorted(camera)) px = DistortPixel(camera, px);
  px = UprightFromStored(px, {camera.width_px, camera.height_px}, copy.orientation);
  const ImageSize size = copy.upright_size();
  return {(px.x() + 0.5) / size.width_px, (px.y() + 0.5) / size.height_px};
}

std::vector<FeatureMatch> FindCounterparts(const PictureCopy& first, const PictureCopy& second) {
  const ImageSize size = first.upright_size(), other_size = second.upright_size();
  const double width_px = std::min(size.width_px, other_size.width_px),
               height_px = std::min(size.height_px, other_size.height_px);
  const std::vector<Eigen::Vector2f> places = PlacesOf(first, width_px, height_px),
                                     others = PlacesOf(second, width_px, height_px);
  std::vector<std::tuple<uint32_t, FeatureIndex, FeatureIndex>> alike;
  for (FeatureIndex a = 0; a < places.size(); ++a) {
    for (FeatureIndex b = 0; b < others.size(); ++b) {
      if ((places[a] - others[b]).squaredNorm() > kApartPxMax * kApartPxMax) continue;
      const uint32_t difference =
          DifferenceOf(first.features.descriptor(a), second.features.descriptor(b));
      if (difference <= kDifferenceMax) alike.emplace_back(difference, a, b);
    }
  }
  std::ranges::sort(alike);
  std::vector<bool> is_taken_a(places.size()), is_taken_b(others.size());
  std::vector<FeatureMatch> counterparts;
  for (const auto& [difference, a, b] : alike) {
    if (is_taken_a[a] || is_taken_b[b]) continue;
    is_taken_a[a] = is_taken_b[b] = true;
    counterparts.push_back({a, b});
  }
  std::ranges::sort(counterparts, {}, &FeatureMatch::a);
  return counterparts;
}

}  // namespace veduta
