// SPDX-License-Identifier: Apache-2.0
// Goal: the adjustment of a whole reconstruction heals it in one transaction: what was merged
//   wrongly is split and each side is as accurate as before, images that lose their poses wait and
//   are tried again, one of which nothing is left is dissolved; the seam of a split is a hypothesis
//   until new evidence comes; the journal tells, `verify` is content, the digest is the same at any
//   thread count, and a step that fails or dies at any operation of the disk leaves nothing half
//   done.
// Method: two sides of a synthetic scene that pairs come to contradict, in a database on a disk
//   that fails at each operation in turn.
#include <gtest/gtest.h>

#include "engine/ingest/follow_up_steps.h"
#include "engine/ingest/forbidding.h"
#include "engine/ingest/healing_writer.h"
#include "engine/ingest/ingest.h"
#include "engine/ingest/region_writer.h"
#include "engine/ingest/submaps.h"
#include "engine/query/city_answers.h"
#include "engine/query/forbidden.h"
#include "engine/query/living.h"
#include "tests/engine/ingest/torn_scene.h"
#include "tests/storage/fault_file_system.h"

namespace veduta {
namespace {

constexpr ReconstructionId kWhole(1), kSplit(2);

struct Healer {
  explicit Healer(SceneDatabase* in) : scene(*in) {}

  Result<AdjustedWhole> Adjust() {
    map.Clear();
    return AdjustWhole(
        {scene.database(), &retrieval, scene.features(), scene.pool(), options, &map}, kWhole,
        BeginWrite(scene.database()));
  }

  SceneDatabase& scene;
  IngestOptions options;
  Retrieval retrieval{{}};
  CityMap map;
};

void Tear(SceneDatabase* scene) {
  EXPECT_EQ(AddTwoSides(scene), kWhole);
  ContradictSeam(scene);
}

// The entries that an action has in the journal: "image reconstruction detail".
std::vector<std::string> Entries(const SceneDatabase& scene, const std::string& action) {
  std::vector<std::string> entries;
  EXPECT_OK(scene.Snap()->ScanJournal(1, [&](const JournalRecord& entry) {
    if (entry.action == action) {
      entries.push_back(std::to_string(entry.image.value) + " " +
                        std::to_string(entry.reconstruction.value) + " " + entry.detail);
    }
    return true;
  }));
  return entries;
}

// The seam is a hypothesis with the pairs that contradict it. A step weighs its sides once, and
// then it waits for new evidence.
void ExpectSeamIsListed(const Snapshot& snapshot) {
  const auto hypotheses = HypothesesOf(snapshot, kSplit);
  ASSERT_OK(hypotheses);
  ASSERT_EQ(hypotheses->size(), 1u);
  const HypothesisRecord stored = snapshot.ListHypotheses()->front();
  EXPECT_EQ(stored.a, kWhole);
  EXPECT_EQ(stored.b, kSplit);
  EXPECT_EQ(stored.reason, RefusalReason::kSplit);
  EXPECT_EQ(stored.a_from_b.scale, 1);
  EXPECT_EQ(stored.a_from_b.translation, Eigen::Vector3d::Zero()) << "both keep the frame";
  EXPECT_EQ(stored.contradicting_pairs, 8u);
  EXPECT_EQ(stored.contradicting_matches, 8u * DoubtOptions().pair_weight_max);
  EXPECT_EQ(stored.judgment_count, 1u);
  EXPECT_TRUE(stored.is_due);
  EXPECT_FALSE(stored.image.valid()) << "no photo has proposed it";
  EXPECT_FALSE(stored.images.empty());
}

TEST(HealingSteps, AWrongMergeIsSplit) {
  std::string digest;
  for (const size_t thread_count : {1, 2}) {
    SceneDatabase scene(kTwoSides, thread_count);
    Tear(&scene);
    Healer healer(&scene);
    const auto adjusted = healer.Adjust();
    ASSERT_OK(adjusted);
    EXPECT_TRUE(adjusted->unplaced.empty());
    EXPECT_EQ(adjusted->split_off, std::vector{kSplit});
    ExpectSound(scene);
    for (const uint32_t k : {0, 1, 2, 3, 4, 5, 6, 7}) {
      const auto pose = *scene.Snap()->FindPose(ImageId(k + 1));
      ASSERT_TRUE(pose.has_value());
      EXPECT_EQ(pose->reconstruction, k < 4 ? kWhole : kSplit);
      // The frame stays, so the truth is that of both.
      EXPECT_LT((pose->cam_from_world.Center() - scene.scene().poses[k].Center()).norm(), 0.02);
    }
    for (const ReconstructionId id : {kWhole, kSplit}) {
      const auto record = GetLiving(*scene.Snap(), id);
      ASSERT_OK(record);
      EXPECT_EQ(record->image_count, 4u);
      EXPECT_EQ(record->images_at_adjustment, 4u);
      EXPECT_GT(record->point_count, 400u);
    }
    EXPECT_EQ(Entries(scene, "split"),
              std::vector<std::string>{"0 2 4 images of reconstruction 1, whose frame it keeps"});
    if (digest.empty()) digest = DigestHex(scene);
    EXPECT_EQ(DigestHex(scene), digest);
    ExpectSeamIsListed(*scene.Snap());
    // Nothing speaks against either any more.
    const auto again = healer.Adjust();
    ASSERT_OK(again);
    EXPECT_TRUE(again->split_off.empty());
    ExpectSound(scene);
  }
}

TEST(HealingSteps, ImagesThatLoseTheirPosesWaitAndAreTriedAgain) {
  SceneDatabase scene;
  scene.AddImages(0, 4);
  EXPECT_EQ(scene.AddReconstruction({0, 1, 2, 3}), kWhole);
  Healer healer(&scene);
  healer.options.mapper.doubt.parts.shared_points_min = 1'000'000;
  const auto adjusted = healer.Adjust();
  ASSERT_OK(adjusted);
  ASSERT_EQ(adjusted->unplaced.size(), 4u);
  EXPECT_EQ(adjusted->unplaced[0].detail,
            "in reconstruction 1, what is known of it contradicts where it was");
  ExpectSound(scene);
  EXPECT_TRUE(scene.Snap()->GetReconstruction(kWhole)->is_dissolved);
  EXPECT_EQ(GetLiving(*scene.Snap(), kWhole).status().message(),
            "reconstruction 1 was dissolved: all its images have lost their poses");
  EXPECT_TRUE(ListLiving(*scene.Snap())->empty());
  EXPECT_EQ(scene.State().pending_propagation, SideImages(0));
  EXPECT_EQ(Entries(scene, "doubt").size(), 4u);
  for (const ImageId id : SideImages(0)) {
    const ImageRecord image = *scene.Snap()->GetImage(id);
    EXPECT_EQ(image.verdict, Verdict::kPostponed);
    EXPECT_EQ(image.reason, Reason::kDoubted);
    EXPECT_FALSE(scene.Snap()->FindPose(id)->has_value());
    EXPECT_TRUE(scene.Snap()->GetObservations(id)->empty());
  }
  // They found another one, of which nothing is doubted.
  Ingest ingest(scene.database(), &healer.retrieval, scene.features(), scene.pool(), {});
  while (const auto step = ingest.RunNextStep()) ASSERT_OK(step->status);
  ExpectSound(scene);
  EXPECT_EQ(ListLiving(*scene.Snap())->size(), 1u);
  EXPECT_EQ(ListLiving(*scene.Snap())->front().id, kSplit);
  EXPECT_TRUE(scene.State().pending_propagation.empty());
}

// Carries out what is due where whatever is placed is doubted by the adjustment that is due at
// once, with an entry of the journal before each step.
void ExpectThatDoubtEnds(const std::string& action_between) {
  SceneDatabase scene;
  scene.AddImages(0, 6);
  EXPECT_EQ(scene.AddReconstruction({0, 1, 2, 3, 4}), kWhole);
  Healer healer(&scene);
  IngestOptions options;
  options.schedule.views_step = 1;
  options.mapper.doubt.parts.shared_points_min = 1'000'000;
  healer.options = options;
  ASSERT_OK(healer.Adjust().status());
  Ingest ingest(scene.database(), &healer.retrieval, scene.features(), scene.pool(), options);
  const auto note = [&] {
    if (action_between.empty()) return;
    DatabaseState state = scene.State();
    const auto transaction = scene.database()->BeginTransaction();
    SceneDatabase::Note({0, 0, "veduta", action_between, {}, kWhole, ""}, &state,
                        transaction.get());
    ASSERT_OK(transaction->Commit());
  };
  size_t steps = 0;
  note();
  while (const auto step = ingest.RunNextStep()) {
    ASSERT_OK(step->status);
    ASSERT_LT(++steps, 50u) << "placing and doubting go on for ever";
    note();
  }
  EXPECT_GT(steps, 5u) << "each was tried again once";
  ExpectSound(scene);
  EXPECT_TRUE(scene.State().pending_propagation.empty());
}

TEST(HealingSteps, DoubtEnds) {
  ExpectThatDoubtEnds("");
}

TEST(HealingSteps, DoubtEndsWhereWhatIsPlacedAgainMerges) {
  ExpectThatDoubtEnds("merge");
}

TEST(HealingSteps, TheStepTellsWhatItTookBack) {
  SceneDatabase scene(kTwoSides);
  Tear(&scene);
  const auto transaction = scene.database()->BeginTransaction();
  ReconstructionRecord record = *scene.Snap()->GetReconstruction(kWhole);
  record.images_at_adjustment = 0;
  transaction->PutReconstruction(record);
  ASSERT_OK(transaction->Commit());
  Retrieval retrieval({});
  Ingest ingest(scene.database(), &retrieval, scene.features(), scene.pool(), {});
  const auto step = ingest.RunNextStep();
  ASSERT_TRUE(step.has_value());
  ASSERT_OK(step->status);
  EXPECT_EQ(step->kind, FollowUpKind::kAdjustment);
  EXPECT_EQ(step->split_off, std::vector{kSplit});
  EXPECT_TRUE(step->unplaced.empty());
  const auto weighing = ingest.RunNextStep();
  ASSERT_TRUE(weighing.has_value());
  EXPECT_EQ(weighing->kind, FollowUpKind::kJudgment);
  EXPECT_FALSE(weighing->merged_into.valid());
  EXPECT_TRUE(weighing->unplaced.empty()) << "all went to the right side";
  EXPECT_FALSE(ingest.RunNextStep().has_value());
}

// A hypothesis about the whole and another one.
void PutHypothesis(SceneDatabase* scene, std::vector<ImageId> images = {ImageId(1)}) {
  HypothesisRecord hypothesis;
  hypothesis.a = kWhole;
  hypothesis.b = ReconstructionId(9);
  hypothesis.a_from_b = AnotherFrame();
  hypothesis.images = images;
  hypothesis.unsure = std::move(images);
  const auto transaction = scene->database()->BeginTransaction();
  transaction->PutHypothesis(hypothesis);
  ASSERT_OK(transaction->Commit());
}

// The hypotheses about the ninth reconstruction after a split.
std::vector<HypothesisRecord> SharedWith(std::vector<ImageId> images) {
  SceneDatabase torn(kTwoSides);
  Tear(&torn);
  PutHypothesis(&torn, std::move(images));
  const auto split = Healer(&torn).Adjust();
  EXPECT_OK(split);
  EXPECT_FALSE(split->split_off.empty());
  std::vector<HypothesisRecord> all = *torn.Snap()->ListHypotheses();
  EXPECT_EQ(std::erase_if(all, [](const auto& h) { return h.reason == RefusalReason::kSplit; }), 1u)
      << "that of the split is new";
  return all;
}

TEST(HealingSteps, EachPartKeepsTheHypothesesOfItsImages) {
  const std::vector<HypothesisRecord> of_one = SharedWith({ImageId(1)});
  ASSERT_EQ(of_one.size(), 1u);
  EXPECT_EQ(of_one[0].a, kWhole);
  EXPECT_TRUE(of_one[0].is_due);
  const std::vector<HypothesisRecord> of_other = SharedWith({ImageId(5)});
  ASSERT_EQ(of_other.size(), 1u);
  EXPECT_EQ(of_other[0].a, kSplit);
  const std::vector<HypothesisRecord> of_both = SharedWith({ImageId(1), ImageId(5), ImageId(6)});
  ASSERT_EQ(of_both.size(), 2u);
  EXPECT_EQ(of_both[0].a, kWhole);
  EXPECT_EQ(of_both[0].images, std::vector{ImageId(1)});
  EXPECT_EQ(of_both[1].a, kSplit);
  EXPECT_EQ(of_both[1].images, (std::vector{ImageId(5), ImageId(6)}));
  EXPECT_EQ(of_both[1].unsure, of_both[1].images);
  EXPECT_EQ(of_both[1].a_from_b.translation, AnotherFrame().translation) << "each keeps the frame";
}

TEST(HealingSteps, HypothesesGoWithWhatIsDissolved) {
  SceneDatabase lost;
  lost.AddImages(0, 4);
  EXPECT_EQ(lost.AddReconstruction({0, 1, 2, 3}), kWhole);
  PutHypothesis(&lost);
  Healer healer(&lost);
  ASSERT_OK(healer.Adjust());
  ASSERT_EQ(lost.Snap()->ListHypotheses()->size(), 1u);
  EXPECT_TRUE(lost.Snap()->ListHypotheses()->front().is_due) << "the whole was adjusted";
  healer.options.mapper.doubt.parts.shared_points_min = 1'000'000;
  ASSERT_OK(healer.Adjust());
  EXPECT_TRUE(lost.Snap()->GetReconstruction(kWhole)->is_dissolved);
  EXPECT_TRUE(lost.Snap()->ListHypotheses()->empty());
}

// One operation fails, and what comes then is either nothing or the whole step.
bool FailsAt(uint64_t n, bool power_cut, const std::string& torn, const std::string& healed) {
  const auto disk = std::make_shared<FaultFileSystem>();
  SceneDatabase scene(kTwoSides, 1, disk);
  Tear(&scene);
  EXPECT_EQ(DigestHex(scene), torn);
  disk->FailWrites(n, Fault::kIoError, 1);
  {
    Healer healer(&scene);
    const auto adjusted = healer.Adjust();
    const bool is_behind = disk->fault_count() == 0;
    if (is_behind) {
      EXPECT_OK(adjusted);
      return false;
    }
  }
  if (power_cut) disk->CutPower();
  scene.Close();
  disk->Heal();
  if (power_cut) n % 2 == 0 ? disk->DropUnsyncedData() : disk->LoseUnsyncedData(n);
  scene.Open();
  ExpectSound(scene);
  const std::string found = DigestHex(scene);
  EXPECT_TRUE(found == torn || found == healed) << "operation " << n << " left half a step";
  if (found == torn) {
    Healer healer(&scene);
    EXPECT_OK(healer.Adjust());
  }
  EXPECT_EQ(DigestHex(scene), healed);
  ExpectSound(scene);
  return true;
}

TEST(HealingSteps, WhateverFailsNothingIsHalfDone) {
  SceneDatabase undisturbed(kTwoSides);
  Tear(&undisturbed);
  const std::string torn = DigestHex(undisturbed);
  ASSERT_OK(Healer(&undisturbed).Adjust());
  const std::string healed = DigestHex(undisturbed);
  ASSERT_NE(torn, healed);
  for (const bool power_cut : {false, true}) {
    uint64_t n = 1;
    while (!HasFailure() && FailsAt(n, power_cut, torn, healed)) ++n;
    EXPECT_GT(n, 3u) << "the step writes";
  }
}

// Of the whole, which is parted, everything or four images go.
class TakingOut : public testing::Test {
 protected:
  void Take(Healing healing) {
    CityMap map;
    const IngestOptions options;
    Retrieval retrieval({});
    const IngestParts parts{scene_.database(), &retrieval, scene_.features(),
                            scene_.pool(),     options,    &map};
    WriteScope scope = BeginWrite(scene_.database());
    DatabaseState state = scene_.State();
    Submaps submaps = *Submaps::Read(*scope.base);
    HealingWriter writer(parts, scope, kWhole, &state);
    ASSERT_OK(TakeOutOfRegion(parts, scope, *scope.base->GetReconstruction(kWhole),
                              std::move(healing), &writer, &submaps));
    submaps.Write(scope.transaction.get());
    scope.transaction->PutState(state);
    ASSERT_OK(scope.transaction->Commit());
  }

  SceneDatabase scene_{{.camera_count = 14, .point_count = 1200}};
};

TEST_F(TakingOut, WhatIsForbiddenOfTheWholeIsForbiddenOfItsPart) {
  scene_.AddImages(0, 14);
  scene_.LimitTracks(3);
  scene_.AddReconstruction({0, 1, 2, 3, 4, 5, 6, 7, 8, 9});
  const ReconstructionId other = scene_.AddReconstruction({10, 11, 12, 13}, AnotherFrame());
  ASSERT_OK(Forbid({ForbiddenKind::kMerge, kWhole.value, other.value, 0, "bea", ""},
                   BeginWrite(scene_.database())));
  Healing part;
  part.parts.push_back({ImageId(7), ImageId(8), ImageId(9), ImageId(10)});
  Take(std::move(part));
  const auto snapshot = scene_.Snap();
  EXPECT_TRUE(*IsMergeForbidden(*snapshot, kWhole, other));
  EXPECT_TRUE(*IsMergeForbidden(*snapshot, ReconstructionId(3), other));
  EXPECT_FALSE(*IsMergeForbidden(*snapshot, kWhole, ReconstructionId(3)));
}

TEST_F(TakingOut, WhatIsDissolvedHasNoPlaceOnTheEarth) {
  scene_.AddImages(0, 6);
  scene_.AddReconstruction({0, 1, 2, 3, 4, 5});
  ReconstructionRecord record = *scene_.Snap()->GetReconstruction(kWhole);
  record.georeference.place.emplace();
  record.georeference.version = 1;
  const auto transaction = scene_.database()->BeginTransaction();
  transaction->PutReconstruction(record);
  ASSERT_OK(transaction->Commit());
  Healing all;
  for (uint32_t id = 1; id <= 6; ++id) all.unplaced.push_back({ImageId(id), "by hand"});
  Take(std::move(all));
  EXPECT_TRUE(scene_.Snap()->GetReconstruction(kWhole)->is_dissolved);
  EXPECT_FALSE(scene_.Snap()->GetReconstruction(kWhole)->georeference.place);
  ExpectSound(scene_);
}

}  // namespace
}  // namespace veduta
