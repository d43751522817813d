// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/markers/marker_code.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdlib>
#include <string>
#include <tuple>
#include <vector>

#include "storage/base/status.h"

namespace veduta {
namespace {

constexpr uint32_t kGenerator = 0b1010'1110'0011;  // x^11 + x^9 + x^7 + x^6 + x^5 + x + 1
constexpr uint32_t kMessageCount = 1u << 12;

// The product of two polynomials over GF(2). Its degree is 22 at most here, so it is a word.
constexpr uint32_t Multiply(uint32_t a, uint32_t b) {
  uint32_t product = 0;
  for (; b != 0; b >>= 1, a <<= 1) {
    if (b & 1) product ^= a;
  }
  return product;
}

constexpr uint32_t SmallestRotation(uint32_t word) {
  uint32_t smallest = word;
  for (int i = 1; i < kMarkerBitCount; ++i)
    smallest = std::min(smallest, RotateMarkerWord(word, i));
  return smallest;
}

std::array<uint32_t, kMarkerIdCount> MakeWords() {
  std::vector<uint32_t> words;
  for (uint32_t message = 1; message < kMessageCount; ++message) {
    const uint32_t word = Multiply(message, kGenerator);
    if (word != kMarkerWordMask && word == SmallestRotation(word)) words.push_back(word);
  }
  // Nearly one-coloured rings are what other things look like most easily, so the words with the
  // most balanced colours come first.
  const auto rank = [](uint32_t word) {
    return std::tuple(std::abs(2 * std::popcount(word) - kMarkerBitCount), word);
  };
  std::sort(words.begin(), words.end(), [&](uint32_t a, uint32_t b) { return rank(a) < rank(b); });
  VEDUTA_CHECK(words.size() == kMarkerIdCount, std::to_string(words.size()) + " words");
  std::array<uint32_t, kMarkerIdCount> table{};
  std::copy(words.begin(), words.end(), table.begin());
  return table;
}

const std::array<uint32_t, kMarkerIdCount>& Words() {
  static const std::array<uint32_t, kMarkerIdCount> words = MakeWords();
  return words;
}

}  // namespace

uint32_t MarkerWord(MarkerId id) {
  return Words().at(id);
}

std::optional<MarkerReading> DecodeMarkerWord(uint32_t word, uint32_t known, int budget) {
  known &= kMarkerWordMask;
  const int erasure_count = kMarkerBitCount - std::popcount(known);
  const int errors_max = (std::min(budget, kMarkerDistanceMin - 1) - erasure_count) / 2;
  if (erasure_count > budget || erasure_count >= kMarkerDistanceMin) return std::nullopt;
  for (MarkerId id = 0; id < kMarkerIdCount; ++id) {
    for (int rotation = 0; rotation < kMarkerBitCount; ++rotation) {
      const int error_count =
          std::popcount((RotateMarkerWord(Words()[id], rotation) ^ word) & known);
      if (error_count <= errors_max) return MarkerReading{id, rotation, error_count};
    }
  }
  return std::nullopt;
}

}  // namespace veduta
