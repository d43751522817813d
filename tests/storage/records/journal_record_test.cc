// SPDX-License-Identifier: Apache-2.0
// Goal: a journal entry comes back as it was stored; one that breaks a rule is not encoded, and a
//   damaged value is kCorruption.
// Method: round trips of full, empty and extreme records at every alignment; one rule broken at
//   a time; values flipped, cut, extended and replaced at seeded places.
#include "storage/records/journal_record.h"

#include <gtest/gtest.h>

#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

TEST(JournalRecord, RoundTrips) {
  const JournalRecord record{std::numeric_limits<uint64_t>::max(),
                             -5,
                             "veduta",
                             "merge",
                             ImageId(3),
                             ReconstructionId(4),
                             "2 into 1"};
  JournalRecord decoded;
  RoundTrip(record, &decoded, record.sequence);
  EXPECT_EQ(decoded.sequence, record.sequence);
  EXPECT_EQ(decoded.time_unix_s, record.time_unix_s);
  EXPECT_EQ(decoded.actor, record.actor);
  EXPECT_EQ(decoded.action, record.action);
  EXPECT_EQ(decoded.image, record.image);
  EXPECT_EQ(decoded.reconstruction, record.reconstruction);
  EXPECT_EQ(decoded.detail, record.detail);
}

TEST(JournalRecord, RefusesWhatBreaksARule) {
  ExpectRefused(JournalRecord{}, "sequence");
}

TEST(JournalRecord, DamagedValueIsCorruption) {
  Fuzz(JournalRecord{1, 2, "a", "add", ImageId(3), ReconstructionId(4), "d"}, uint64_t{1});
}

TEST(JournalRecord, KeyReadsBackAndSorts) {
  const uint64_t numbers[] = {0, 1, 255, 256, uint64_t{kMax} + 1, ~uint64_t{0}};
  for (const uint64_t a : numbers) {
    uint64_t sequence = 0;
    ASSERT_OK(ParseJournalKey(JournalKey(a), &sequence));
    EXPECT_EQ(sequence, a);
    EXPECT_EQ(ParseJournalKey(JournalKey(a) + "x", &sequence).code(), StatusCode::kCorruption);
    for (const uint64_t b : numbers) EXPECT_EQ(JournalKey(a) < JournalKey(b), a < b);
  }
}

}  // namespace
}  // namespace veduta
