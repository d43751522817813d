// SPDX-License-Identifier: Apache-2.0
#pragma once
// The units of one coded still picture of HEVC, as HEIF stores them.

#include <cstdint>
#include <span>
#include <vector>

namespace veduta {

// A picture takes one unit of parameters of each kind; more make libde265 allocate tables for each.
inline constexpr int kHevcParameterUnitsMax = 4;

enum class HevcStreamOutcome : uint8_t { kTaken, kCutShort, kNoStillPicture, kTooLarge };

// Gathers the units that bear on the pixels: the sets of parameters, and the slices of one picture
// that needs no other. Every other kind of unit is passed over.
class HevcStream final {
 public:
  explicit HevcStream(uint64_t pixels_max) : pixels_max_(pixels_max) {}

  // Takes units that each follow their length of 4 bytes, the highest first. The bytes are copied.
  HevcStreamOutcome Push(std::span<const uint8_t> bytes);
  const std::vector<std::vector<uint8_t>>& units() const { return units_; }
  int picture_count() const { return picture_count_; }

 private:
  HevcStreamOutcome PushUnit(std::span<const uint8_t> unit);

  const uint64_t pixels_max_;
  std::vector<std::vector<uint8_t>> units_;
  int parameter_unit_count_[3] = {0, 0, 0};  // of videos, sequences and pictures
  int picture_count_ = 0;
};

// How many pixels a unit with a sequence's parameters (ITU-T H.265, 7.3.2.2) says that its pictures
// have. Zero where it cannot be read, or where its sizes are not those of whole blocks.
uint64_t HevcPixelCount(std::span<const uint8_t> unit);

}  // namespace veduta
