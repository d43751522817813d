// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the ring of a marker says: a word of the binary Golay code.
//
// The ring has 23 sectors, dark or bright. Golay's [23, 12, 7] code is cyclic, so all 23 rotations
// of a word are words again, and any two of its 4096 words differ in at least 7 sectors. Without
// the two words of one colour there are 4094 / 23 = 178 classes under rotation, and each class is
// one id. A ring turned in any way differs in 7 sectors or more from every rotation of every other
// id and from every other rotation of itself. Source: M. Golay, Notes on digital coding, Proc. IRE
// 37, 1949; generator
// x^11 + x^9 + x^7 + x^6 + x^5 + x + 1.

#include <cstdint>
#include <optional>

namespace veduta {

using MarkerId = uint32_t;  // [0, kMarkerIdCount)

inline constexpr int kMarkerBitCount = 23;
inline constexpr uint32_t kMarkerIdCount = 178;
inline constexpr int kMarkerDistanceMin = 7;  // Hamming, between different words in any rotation
inline constexpr uint32_t kMarkerWordMask = (1u << kMarkerBitCount) - 1;

// The ring's sectors, bit i for the i-th counted clockwise: 1 is bright. Low ids have the most
// balanced words (11 or 12 bright sectors up to id 111). `id` < kMarkerIdCount.
uint32_t MarkerWord(MarkerId id);

// The word read where `word` was when counting starts `count` sectors later; count in [0, 23).
constexpr uint32_t RotateMarkerWord(uint32_t word, int count) {
  return ((word >> count) | (word << (kMarkerBitCount - count))) & kMarkerWordMask;
}

struct MarkerReading {
  MarkerId id = 0;
  // But for the errors, the word read is RotateMarkerWord(MarkerWord(id), rotation).
  int rotation = 0;
  int error_count = 0;
};

// The word nearest to the sectors read, if it is near enough: 2 x errors + erasures <= `budget`.
// Erasures are the sectors whose bit in `known` is 0: they were not read. At a budget of 6 or less
// the answer is unique. It is wrong only if more sectors went wrong than the budget allows for.
// About 4 us. Thread-safe.
std::optional<MarkerReading> DecodeMarkerWord(uint32_t word, uint32_t known, int budget);

}  // namespace veduta
