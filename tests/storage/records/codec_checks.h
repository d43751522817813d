// SPDX-License-Identifier: Apache-2.0
#pragma once
// What every record's codec must keep, for the tests of storage/records/.

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "storage/base/content_hash.h"
#include "tests/storage/samples.h"

namespace veduta {

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
inline constexpr uint32_t kMax = std::numeric_limits<uint32_t>::max();

// `value` at a chosen distance from an 8-byte boundary, followed by nothing that belongs to it.
class Shifted final {
 public:
  Shifted(std::string_view value, size_t shift)
      : memory_(value.size() / 8 + 3), shift_(shift), size_(value.size()) {
    std::memcpy(reinterpret_cast<char*>(memory_.data()) + shift, value.data(), value.size());
  }
  std::string_view view() const {
    return {reinterpret_cast<const char*>(memory_.data()) + shift_, size_};
  }

 private:
  std::vector<uint64_t> memory_;
  size_t shift_, size_;
};

// Encodes, decodes at all eight alignments, and encodes again: equal bytes mean that every stored
// field came back.
template <typename Record, typename... Ids>
void RoundTrip(const Record& record, Record* decoded, Ids... ids) {
  const Result<std::string> value = Encode(record);
  ASSERT_OK(value);
  for (size_t shift = 0; shift < 8; ++shift) {
    ASSERT_OK(Decode(Shifted(*value, shift).view(), ids..., decoded));
    const Result<std::string> again = Encode(*decoded);
    ASSERT_OK(again);
    ASSERT_EQ(*again, *value) << "shift " << shift;
  }
}

// The record is not encoded, and the reason has this word.
template <typename Record>
void ExpectRefused(const Record& record, const std::string& word) {
  const Result<std::string> value = Encode(record);
  ASSERT_FALSE(value.ok()) << word;
  EXPECT_EQ(value.status().code(), StatusCode::kInvalidArgument);
  EXPECT_NE(value.status().message().find(word), std::string::npos) << value.status().message();
}

// Damages `value` in one of several ways.
inline std::string Damage(std::string value, SeededRandom* random) {
  switch (random->Below(5)) {
    case 0:
      for (uint32_t i = 0; i <= random->Below(4); ++i) {
        value[random->Below(static_cast<uint32_t>(value.size()))] ^=
            static_cast<char>(1u << random->Below(8));
      }
      break;
    case 1:  // where the pointers are
      value[random->Below(std::min<uint32_t>(static_cast<uint32_t>(value.size()), 128))] ^=
          static_cast<char>(1 + random->Below(255));
      break;
    case 2:
      value.resize(random->Below(static_cast<uint32_t>(value.size())));
      break;
    case 3:
      value.append(1 + random->Below(20), static_cast<char>(random->Next()));
      break;
    default: {  // a word of its own choosing
      const uint64_t word = random->Next();
      std::memcpy(value.data() + 8 * random->Below(static_cast<uint32_t>(value.size() / 8)), &word,
                  8);
    }
  }
  return value;
}

// What decodes in spite of the damage must be a record that can be encoded.
template <typename Record, typename... Ids>
void Fuzz(const Record& record, Ids... ids) {
  const std::string value = *Encode(record);
  size_t corrupt = 0;
  constexpr size_t kRounds = 3000;
  for (size_t seed = 0; seed < kRounds; ++seed) {
    SeededRandom random(seed);
    const std::string damaged = Damage(value, &random);
    Record decoded = record;  // with the ids, where the caller of Decode sets them
    // An exact heap copy, so that the address sanitizer sees a read past its end.
    const std::vector<char> bytes(damaged.begin(), damaged.end());
    const Status status = Decode(std::string_view(bytes.data(), bytes.size()), ids..., &decoded);
    if (status.ok()) {
      ASSERT_OK(Encode(decoded)) << "seed " << seed;
    } else {
      ASSERT_EQ(status.code(), StatusCode::kCorruption) << status.message();
      ASSERT_FALSE(status.message().empty());
      ++corrupt;
    }
  }
  // Two kinds of damage in five change the length, and are always noticed.
  EXPECT_GT(corrupt, kRounds * 3 / 10);
}

// A value cut short at every length is damage.
template <typename Record, typename... Ids>
void ExpectEveryCutIsCorruption(const Record& record, Ids... ids) {
  const std::string value = *Encode(record);
  for (size_t size = 0; size < value.size(); ++size) {
    Record decoded = record;
    EXPECT_EQ(Decode(std::string_view(value).substr(0, size), ids..., &decoded).code(),
              StatusCode::kCorruption)
        << size;
  }
}

}  // namespace veduta
