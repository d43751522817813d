// SPDX-License-Identifier: Apache-2.0
#pragma once
// Strong ids: one type a noun, so that an image's number cannot be passed where a point's is meant.

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>

namespace veduta {

template <typename Tag, typename Integer>
struct StrongId {
  Integer value = 0;

  constexpr StrongId() = default;
  constexpr explicit StrongId(Integer v) : value(v) {}
  constexpr bool valid() const { return value != 0; }
  constexpr auto operator<=>(const StrongId&) const = default;
};

// All ids start at 1; 0 is "none".
using ImageId = StrongId<struct ImageTag, uint32_t>;
using CameraId = StrongId<struct CameraTag, uint32_t>;
using ReconstructionId = StrongId<struct ReconstructionTag, uint32_t>;
using SubmapId = StrongId<struct SubmapTag, uint32_t>;
using FeatureIndex = uint32_t;  // an index into one image's features, strongest first
using WordId = uint32_t;        // a leaf of the vocabulary tree

// A point is named by the image it was first triangulated from and a number within that image. The
// name survives merges of reconstructions, because an image belongs to one reconstruction only.
struct PointId {
  ImageId home;
  uint32_t ordinal = 0;

  constexpr bool valid() const { return home.valid(); }
  constexpr auto operator<=>(const PointId&) const = default;
};

}  // namespace veduta

template <typename Tag, typename Integer>
struct std::hash<veduta::StrongId<Tag, Integer>> {
  size_t operator()(veduta::StrongId<Tag, Integer> id) const noexcept {
    return std::hash<Integer>()(id.value);
  }
};
template <>
struct std::hash<veduta::PointId> {
  size_t operator()(veduta::PointId id) const noexcept {
    return (static_cast<uint64_t>(id.home.value) << 32 | id.ordinal) * 0x9E3779B97F4A7C15ull >> 7;
  }
};
