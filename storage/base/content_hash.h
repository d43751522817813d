// SPDX-License-Identifier: Apache-2.0
#pragma once
// SHA-256, by OpenSSL: a photo's identity and the database's digest.

#include <array>
#include <compare>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace veduta {

struct ContentHash {
  std::array<uint8_t, 32> bytes{};

  auto operator<=>(const ContentHash&) const = default;
  std::string Hex() const;
  // 64 bits of it: the seed of everything random about this content.
  uint64_t Seed() const;
};

ContentHash HashContent(std::span<const uint8_t> content);

// Hash of a stream of pieces. Not thread-safe.
class ContentHasher {
 public:
  ContentHasher();
  ~ContentHasher();
  ContentHasher(const ContentHasher&) = delete;
  ContentHasher& operator=(const ContentHasher&) = delete;

  void Add(std::span<const uint8_t> bytes);
  void Add(std::string_view text);
  // The hash of everything added; the hasher must not be used after.
  ContentHash Finish();

 private:
  void* context_;
};

// A well-mixed 64-bit value from two: seeds of sub-problems (splitmix64's finaliser).
constexpr uint64_t MixSeed(uint64_t a, uint64_t b) {
  uint64_t z = a + 0x9E3779B97F4A7C15ull * (b + 1);
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
  return z ^ (z >> 31);
}

// A small deterministic generator (splitmix64), the same on every platform, unlike std's
// distributions.
class SeededRandom {
 public:
  explicit SeededRandom(uint64_t seed) : state_(seed) {}
  uint64_t Next() { return MixSeed(state_++, 0x5851F42D4C957F2Dull); }
  // Uniform in [0, bound), bound > 0; the bias of the multiply-shift is below 2^-32.
  uint32_t Below(uint32_t bound) { return static_cast<uint32_t>((Next() >> 32) * bound >> 32); }
  // Uniform in [0, 1).
  double Unit() { return static_cast<double>(Next() >> 11) * 0x1.0p-53; }

 private:
  uint64_t state_;
};

}  // namespace veduta
