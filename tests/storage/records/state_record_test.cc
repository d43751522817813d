// SPDX-License-Identifier: Apache-2.0
// Goal: a state comes back as it was stored; one that breaks a rule is not encoded, and a damaged
//   value is kCorruption.
// Method: round trips of full, empty and extreme records at every alignment; one rule broken at
//   a time; values flipped, cut, extended and replaced at seeded places.
#include "storage/records/state_record.h"

#include <gtest/gtest.h>

#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

TEST(StateRecord, RoundTrips) {
  DatabaseState decoded;
  RoundTrip(SampleState(12), &decoded);
  EXPECT_EQ(decoded, SampleState(12));
  RoundTrip(DatabaseState{}, &decoded);
  EXPECT_EQ(decoded, DatabaseState{});
  DatabaseState extreme = SampleState(kMax);
  extreme.next_journal = extreme.next_blob = std::numeric_limits<uint64_t>::max();
  extreme.pending_propagation.assign(100'000, ImageId(kMax));
  RoundTrip(extreme, &decoded);
  EXPECT_EQ(decoded, extreme);
  extreme.counts = DatabaseCounts{.images = ~0ull, .placed = 3, .postponed = 4, .cameras = 5};
  RoundTrip(extreme, &decoded);
  EXPECT_EQ(decoded, extreme);
  extreme.counts.reset();
  RoundTrip(extreme, &decoded);
  EXPECT_FALSE(decoded.counts.has_value());
}

TEST(StateRecord, RefusesWhatBreaksARule) {
  DatabaseState state;
  state.next_camera = 0;
  ExpectRefused(state, "next_camera");
  state = SampleState(2);
  state.pending_propagation.emplace_back(0);
  ExpectRefused(state, "pending_propagation");
}

TEST(StateRecord, DamagedValueIsCorruption) {
  Fuzz(SampleState(5));
}

}  // namespace
}  // namespace veduta
