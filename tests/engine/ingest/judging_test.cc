// SPDX-License-Identifier: Apache-2.0
// Goal: a merge that was not believed is judged anew when what it rests on has changed: it is made
//   once the evidence allows it, keeps its new votes where it does not, and goes where nothing is
//   left to judge; two that are parted again and again stay apart until more photos come; the same
//   on any number of threads, and whole or not at all.
// Method: one synthetic scene stored as two reconstructions, with a hypothesis that they are one;
//   options that believe nothing, or everything that holds.
#include "engine/ingest/judging.h"

#include <gtest/gtest.h>

#include "engine/ingest/forbidding.h"
#include "engine/ingest/ingest.h"
#include "engine/journal/journal.h"
#include "engine/query/digest.h"
#include "tests/engine/ingest/scene_database.h"
#include "tests/storage/fault_file_system.h"

namespace veduta {
namespace {

constexpr ReconstructionId kFirst(1), kSecond(2);

IngestOptions Believing() {
  IngestOptions options;
  options.schedule.views_step = 100;
  return options;
}
IngestOptions Unbelieving() {
  IngestOptions options = Believing();
  options.mapper.doubt.seam_pairs_min = 100;
  return options;
}

class Judging : public testing::Test {
 protected:
  explicit Judging(size_t thread_count = 1, std::shared_ptr<rocksdb::FileSystem> disk = nullptr)
      : scene_({.camera_count = 8, .point_count = 2000}, thread_count, std::move(disk)) {
    scene_.AddImages(0, 8);
    scene_.AddReconstruction({0, 1, 2, 3});
    scene_.AddReconstruction({4, 5, 6, 7}, AnotherFrame());
    Put({ImageId(4), ImageId(5)}, true);
  }

  void Put(std::vector<ImageId> images, bool is_due) {
    HypothesisRecord hypothesis;
    hypothesis.a = kFirst;
    hypothesis.b = kSecond;
    hypothesis.a_from_b = AnotherFrame().Inverse();
    hypothesis.image = ImageId(5);
    hypothesis.images = std::move(images);
    hypothesis.is_due = is_due;
    const auto transaction = scene_.database()->BeginTransaction();
    transaction->PutHypothesis(hypothesis);
    ASSERT_OK(transaction->Commit());
  }
  void Note(const std::string& action, ReconstructionId about) {
    const auto transaction = scene_.database()->BeginTransaction();
    DatabaseState state = scene_.State();
    AppendJournal({0, 0, "veduta", action, {}, about, ""}, &state, transaction.get());
    transaction->PutState(state);
    ASSERT_OK(transaction->Commit());
  }
  // A part that was split off, and merged since where `into` is given.
  void NoteSplit(ReconstructionId part, ReconstructionId into) {
    if (into.valid()) {
      const auto transaction = scene_.database()->BeginTransaction();
      ReconstructionRecord record;
      record.id = part;
      record.merged_into = into;
      transaction->PutReconstruction(record);
      ASSERT_OK(transaction->Commit());
    }
    Note("split", part);
  }
  std::optional<HypothesisRecord> Stored() {
    const auto all = scene_.Snap()->ListHypotheses();
    EXPECT_OK(all);
    if (!all.ok() || all->empty()) return std::nullopt;
    return all->front();
  }
  // The kinds of all steps that are due, carried out.
  std::vector<FollowUp> Settle(const IngestOptions& options) {
    Retrieval retrieval({});
    Ingest ingest(scene_.database(), &retrieval, scene_.features(), scene_.pool(), options);
    std::vector<FollowUp> done;
    while (auto step = ingest.RunNextStep()) {
      EXPECT_OK(step->status);
      done.push_back(std::move(*step));
    }
    return done;
  }
  bool IsSound() {
    const auto violations = FindViolations(*scene_.Snap(), 9);
    EXPECT_OK(violations);
    return violations.ok() && violations->empty();
  }

  SceneDatabase scene_;
};

TEST_F(Judging, OneThatIsStillNotBelievedKeepsItsNewVotes) {
  const auto done = Settle(Unbelieving());
  ASSERT_EQ(done.size(), 1u);
  EXPECT_EQ(done[0].kind, FollowUpKind::kJudgment);
  EXPECT_EQ(done[0].reconstruction, kFirst);
  EXPECT_EQ(done[0].other, kSecond);
  EXPECT_FALSE(done[0].merged_into.valid());
  const auto judged = Stored();
  ASSERT_TRUE(judged.has_value());
  EXPECT_FALSE(judged->is_due);
  EXPECT_EQ(judged->judgment_count, 2u);
  EXPECT_EQ(judged->reason, RefusalReason::kFewPairs);
  EXPECT_GE(judged->common_point_count, 20u);
  EXPECT_GE(judged->agreeing_pairs, 4u);
  EXPECT_EQ(judged->contradicting_pairs, 0u);
  EXPECT_GT(judged->agreeing_matches, 100u);
  EXPECT_GT(judged->judged_cells, 20u);
  EXPECT_EQ(judged->image, ImageId(5));
  EXPECT_GE(judged->images.size(), 4u) << "the seam is known better now";
  EXPECT_NEAR(judged->a_from_b.scale, 2, 2e-3);
  EXPECT_TRUE(IsSound());
  EXPECT_TRUE(Settle(Believing()).empty()) << "nothing has changed since";
}

TEST_F(Judging, TheMergeIsMadeOnceTheEvidenceAllowsIt) {
  const auto done = Settle(Believing());
  ASSERT_GE(done.size(), 2u);
  EXPECT_EQ(done[0].kind, FollowUpKind::kJudgment);
  EXPECT_EQ(done[0].merged_into, kFirst);
  EXPECT_EQ(done[1].kind, FollowUpKind::kAdjustment);
  EXPECT_FALSE(Stored().has_value());
  const ReconstructionRecord second = *scene_.Snap()->GetReconstruction(kSecond);
  EXPECT_EQ(second.merged_into, kFirst);
  EXPECT_NEAR(second.merged_from_this.scale, 2, 2e-3);
  EXPECT_EQ(scene_.Snap()->GetReconstruction(kFirst)->image_count, 8u);
  EXPECT_EQ((*scene_.Snap()->FindPose(ImageId(8)))->reconstruction, kFirst);
  size_t judged = 0;
  EXPECT_OK(scene_.Snap()->ScanJournal(1, [&](const JournalRecord& entry) {
    judged += entry.action == "judge" && entry.reconstruction == kFirst;
    return true;
  }));
  EXPECT_EQ(judged, 1u);
  EXPECT_TRUE(IsSound());
}

TEST_F(Judging, TwoThatWerePartedAgainAndAgainStayApartUntilPhotosCome) {
  for (const ReconstructionId part : {ReconstructionId(3), ReconstructionId(4), kSecond})
    NoteSplit(part, part == kSecond ? ReconstructionId() : kFirst);
  EXPECT_EQ(Settle(Believing()).size(), 1u);
  ASSERT_TRUE(Stored());
  EXPECT_FALSE(Stored()->is_due);
  for (int i = 0; i < 2; ++i) Note("add", {});
  Put({ImageId(4), ImageId(5)}, true);
  EXPECT_FALSE(Settle(Believing()).empty());
  EXPECT_FALSE(Stored()) << "photos have come since";
}

TEST_F(Judging, WhoStandsOnEitherSideIsUnsureWhereThePlacesAreToldApart) {
  Settle(Unbelieving());
  EXPECT_EQ(Stored()->reason, RefusalReason::kFewPairs);
  EXPECT_TRUE(Stored()->unsure.empty()) << "perhaps it is one place";
  Put({ImageId(4), ImageId(5)}, true);
  IngestOptions options = Believing();
  options.mapper.doubt.missing_cells_min = 1;
  options.mapper.doubt.missing_share_max = 0.5;
  options.mapper.doubt.seam_missing_share_max = 1e-9;
  // Another person's picture of a twin: all is alike, but something is missing.
  options.mapper.doubt.seam_visibility.search_radius_px = 1e-3;
  Settle(options);
  ASSERT_TRUE(Stored());
  EXPECT_EQ(Stored()->reason, RefusalReason::kMissingStructure);
  EXPECT_EQ(Stored()->unsure, Stored()->images);
  EXPECT_TRUE(IsSound());
  Put(Stored()->images, true);
  Settle(Believing());
  EXPECT_FALSE(Stored()) << "once the merge is believed, everybody is sure";
}

TEST_F(Judging, TheSecondSideWillDo) {
  Put({ImageId(5), ImageId(6)}, true);
  const auto done = Settle(Believing());
  ASSERT_FALSE(done.empty());
  EXPECT_TRUE(done[0].merged_into.valid());
  EXPECT_FALSE(Stored().has_value());
  EXPECT_TRUE(IsSound());
}

TEST_F(Judging, WithoutEnoughPointsTheKnownSimilarityIsJudged) {
  IngestOptions options = Believing();
  options.mapper.common_points_min = 100'000;
  options.mapper.view_alignment.other_sightings_min = 100'000;
  options.mapper.loop.other_sightings_min = 100'000;
  options.mapper.loop.matches_min = 100'000;
  ASSERT_EQ(Settle(options).size(), 1u);
  const auto judged = Stored();
  ASSERT_TRUE(judged.has_value());
  EXPECT_EQ(judged->reason, RefusalReason::kFewPoints);
  EXPECT_EQ(judged->common_point_count, 0u);
  EXPECT_GE(judged->agreeing_pairs, 4u);
  EXPECT_NEAR(judged->a_from_b.scale, 2, 1e-6);
  EXPECT_TRUE(IsSound());
}

TEST_F(Judging, OneWithoutAnythingAcrossGoes) {
  for (uint32_t a = 1; a <= 4; ++a) {
    for (uint32_t b = 5; b <= 8; ++b) {
      ASSERT_OK(Forbid({ForbiddenKind::kPair, a, b, 0, "bea", ""}, BeginWrite(scene_.database())));
    }
  }
  ASSERT_EQ(Settle(Believing()).size(), 1u);
  EXPECT_FALSE(Stored().has_value());
  EXPECT_TRUE(IsSound());
}

TEST_F(Judging, OneThatNoPlacedImageIsAtGoes) {
  scene_.AddReconstruction({0, 1, 2});  // their poses lie elsewhere now
  Put({ImageId(1)}, true);
  Retrieval retrieval({});
  CityMap map;
  const IngestOptions options = Believing();
  const IngestParts parts{scene_.database(), &retrieval, scene_.features(),
                          scene_.pool(),     options,    &map};
  const auto judged = JudgeAnew(parts, kFirst, kSecond, BeginWrite(scene_.database()));
  ASSERT_OK(judged);
  EXPECT_FALSE(judged->merged_into.valid());
  EXPECT_FALSE(Stored().has_value());
  EXPECT_EQ(JudgeAnew(parts, kFirst, kSecond, BeginWrite(scene_.database())).status().code(),
            StatusCode::kNotFound);
}

TEST_F(Judging, AnAdjustmentOfEitherMakesItDue) {
  Put({ImageId(4), ImageId(5)}, false);
  EXPECT_TRUE(Settle(Unbelieving()).empty());
  ReconstructionRecord record = *scene_.Snap()->GetReconstruction(kSecond);
  record.images_at_adjustment = 0;
  const auto transaction = scene_.database()->BeginTransaction();
  transaction->PutReconstruction(record);
  ASSERT_OK(transaction->Commit());
  const auto done = Settle(Unbelieving());
  ASSERT_EQ(done.size(), 2u);
  EXPECT_EQ(done[0].kind, FollowUpKind::kAdjustment);
  EXPECT_EQ(done[1].kind, FollowUpKind::kJudgment);
  EXPECT_EQ(Stored()->judgment_count, 2u);
  EXPECT_TRUE(IsSound());
}

TEST_F(Judging, ACommitInBetweenIsAConflictAndNothingHasHappened) {
  Retrieval retrieval({});
  CityMap map;
  const IngestOptions options = Believing();
  const IngestParts parts{scene_.database(), &retrieval, scene_.features(),
                          scene_.pool(),     options,    &map};
  WriteScope scope = BeginWrite(scene_.database());
  const auto other = scene_.database()->BeginTransaction();
  other->PutState(scene_.State());
  ASSERT_OK(other->Commit());
  EXPECT_EQ(JudgeAnew(parts, kFirst, kSecond, std::move(scope)).status().code(), StatusCode::kBusy);
  EXPECT_TRUE(Stored()->is_due);
  EXPECT_TRUE(scene_.Snap()->GetReconstruction(kSecond)->is_living());
  EXPECT_TRUE(IsSound());
}

// The same outside of a test's own fixture.
class Scenario final : public Judging {
 public:
  explicit Scenario(std::shared_ptr<rocksdb::FileSystem> disk = nullptr)
      : Judging(1, std::move(disk)) {}
  void TestBody() override {}

  std::string Digest() { return DigestOf(*scene_.Snap())->Hex(); }
  std::string SettledDigest(const IngestOptions& options) {
    Settle(options);
    return Digest();
  }
  Result<Judgment> Judge() {
    Retrieval retrieval({});
    CityMap map;
    const IngestOptions options = Believing();
    return JudgeAnew(
        {scene_.database(), &retrieval, scene_.features(), scene_.pool(), options, &map}, kFirst,
        kSecond, BeginWrite(scene_.database()));
  }
  void Reopen(FaultFileSystem* disk, uint64_t n) {
    disk->CutPower();
    scene_.Close();
    disk->Heal();
    n % 2 == 0 ? disk->DropUnsyncedData() : disk->LoseUnsyncedData(n);
    scene_.Open();
  }
  using Judging::IsSound;
};

TEST(JudgingFaults, APowerCutAtAnyOperationLeavesNothingOrAll) {
  Scenario undisturbed;
  const std::string before = undisturbed.Digest();
  ASSERT_OK(undisturbed.Judge());
  const std::string judged = undisturbed.Digest();
  const std::string settled = undisturbed.SettledDigest(Believing());
  ASSERT_NE(before, judged);
  uint64_t n = 1;
  for (bool is_behind = false; !is_behind && !HasFailure(); ++n) {
    const auto disk = std::make_shared<FaultFileSystem>();
    Scenario scenario(disk);
    disk->FailWrites(n, Fault::kIoError, 1);
    const auto merged = scenario.Judge();
    is_behind = disk->fault_count() == 0;
    if (is_behind) {
      EXPECT_OK(merged);
      break;
    }
    scenario.Reopen(disk.get(), n);
    EXPECT_TRUE(scenario.IsSound());
    const std::string found = scenario.Digest();
    EXPECT_TRUE(found == before || found == judged) << "operation " << n << " left half a step";
    EXPECT_EQ(scenario.SettledDigest(Believing()), settled) << n;
  }
  EXPECT_GT(n, 1u) << "the step writes";
}

class JudgingOnThreads : public Judging {
 protected:
  JudgingOnThreads() : Judging(3) {}
};

TEST_F(JudgingOnThreads, GiveTheSame) {
  Scenario refused, merged;
  const std::string expected = refused.SettledDigest(Unbelieving()),
                    after_merge = merged.SettledDigest(Believing());
  Settle(Unbelieving());
  EXPECT_EQ(DigestOf(*scene_.Snap())->Hex(), expected);
  Put({ImageId(4), ImageId(5)}, true);
  Settle(Believing());
  EXPECT_EQ(DigestOf(*scene_.Snap())->Hex(), after_merge);
}

}  // namespace
}  // namespace veduta
