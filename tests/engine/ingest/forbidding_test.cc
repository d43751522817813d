// SPDX-License-Identifier: Apache-2.0
// Goal: what people forbid is obeyed: a pair is deleted, a merge is followed through other merges,
//   and a photo whose pose is forbidden loses it at once, with what cannot stand without it, and
//   gets none by any step until that is allowed again. `verify` notices what contradicts it.
// Method: a synthetic scene in a database; after each statement all invariants are checked, and all
//   steps that follow are carried out.
#include "engine/ingest/forbidding.h"

#include <gtest/gtest.h>

#include "engine/ingest/ingest.h"
#include "engine/query/digest.h"
#include "engine/query/forbidden.h"
#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

constexpr ReconstructionId kFirst(1);

WriteScope Begin(SceneDatabase* scene) {
  return BeginWrite(scene->database());
}

TEST(Forbidding, APairIsDeletedAndItsReconstructionJudgedAnew) {
  SceneDatabase scene;
  scene.AddImages(0, 4);
  const ReconstructionId id = scene.AddReconstruction({0, 1, 2, 3});
  ASSERT_OK(scene.Snap()->GetPair(ImageId(1), ImageId(2)));
  ASSERT_OK(Forbid({ForbiddenKind::kPair, 2, 1, 0, "bea", "two towers"}, Begin(&scene)));
  EXPECT_EQ(scene.Snap()->GetPair(ImageId(1), ImageId(2)).status().code(), StatusCode::kNotFound);
  EXPECT_TRUE(*scene.Snap()->IsForbidden(ForbiddenKind::kPair, 1, 2));
  EXPECT_EQ(scene.Snap()->GetReconstruction(id)->images_at_adjustment, 0u);
  const uint64_t before = scene.Snap()->sequence();
  ASSERT_OK(Forbid({ForbiddenKind::kPair, 1, 2, 0, "ben", ""}, Begin(&scene)));
  EXPECT_EQ(scene.Snap()->sequence(), before) << "it is forbidden already";
  Retrieval retrieval({});
  Ingest ingest(scene.database(), &retrieval, scene.features(), scene.pool(), {});
  while (const auto step = ingest.RunNextStep()) ASSERT_OK(step->status);
  ASSERT_OK(Allow(ForbiddenKind::kPair, 2, 1, "bea", "", Begin(&scene)));
  EXPECT_FALSE(*scene.Snap()->IsForbidden(ForbiddenKind::kPair, 1, 2));
  EXPECT_EQ(Allow(ForbiddenKind::kPair, 2, 1, "bea", "", Begin(&scene)).code(),
            StatusCode::kNotFound);
  EXPECT_EQ(Forbid({ForbiddenKind::kPair, 3, 3, 0, "", ""}, Begin(&scene)).code(),
            StatusCode::kInvalidArgument);
  EXPECT_EQ(Forbid({ForbiddenKind::kPair, 3, 9, 0, "", ""}, Begin(&scene)).code(),
            StatusCode::kNotFound);
}

TEST(Forbidding, AMergeIsFollowedThroughOtherMerges) {
  SceneDatabase scene;
  scene.AddImages(0, 3);
  const ReconstructionId a = scene.AddReconstruction({0, 1, 2});
  auto transaction = scene.database()->BeginTransaction();
  DatabaseState state = scene.State();
  for (uint32_t id = 2; id <= 4; ++id) {
    ReconstructionRecord record;
    record.id = ReconstructionId(id);
    record.points_generation = 1;
    if (id == 4) record.merged_into = ReconstructionId(2);
    transaction->PutReconstruction(record);
  }
  state.next_reconstruction = 5;
  transaction->PutState(state);
  ASSERT_OK(transaction->Commit());
  ASSERT_OK(Forbid({ForbiddenKind::kMerge, 4, 1, 0, "bea", ""}, Begin(&scene)));
  EXPECT_TRUE(*IsMergeForbidden(*scene.Snap(), a, ReconstructionId(2)));
  EXPECT_TRUE(*IsMergeForbidden(*scene.Snap(), ReconstructionId(2), a));
  EXPECT_FALSE(*IsMergeForbidden(*scene.Snap(), a, ReconstructionId(3)));
  EXPECT_EQ(*MergedEnd(*scene.Snap(), ReconstructionId(4)), ReconstructionId(2));
  EXPECT_EQ(Forbid({ForbiddenKind::kMerge, 4, 2, 0, "bea", ""}, Begin(&scene)).code(),
            StatusCode::kInvalidArgument)
      << "they are one";
  EXPECT_EQ(MergedEnd(*scene.Snap(), ReconstructionId(9)).status().code(), StatusCode::kNotFound);
}

// A scene with the parts that steps are carried out by.
class Stated {
 public:
  Stated()
      : retrieval_({}),
        ingest_(scene_.database(), &retrieval_, scene_.features(), scene_.pool(), {}) {}

  SceneDatabase* scene() { return &scene_; }
  void Forbid(uint32_t id) {
    EXPECT_OK(ingest_.ForbidPose(ImageId(id), "bea", "a twin of the tower"));
    ExpectSound();
  }
  void Allow(uint32_t id) {
    EXPECT_OK(
        veduta::Allow(ForbiddenKind::kPose, id, id, "bea", "it is the tower", Begin(&scene_)));
    ExpectSound();
  }
  void Settle() {
    while (const auto step = ingest_.RunNextStep()) EXPECT_OK(step->status);
    ExpectSound();
  }
  // Has the image tried again, as when a neighbour gets a pose, and does what follows.
  void Retry(uint32_t id) {
    DatabaseState state = scene_.State();
    state.pending_propagation.push_back(ImageId(id));
    const auto transaction = scene_.database()->BeginTransaction();
    transaction->PutState(state);
    EXPECT_OK(transaction->Commit());
    Settle();
  }
  bool HasPose(uint32_t id) const { return scene_.Snap()->FindPose(ImageId(id))->has_value(); }
  void ExpectSound() const {
    const auto violations = FindViolations(*scene_.Snap(), 5);
    ASSERT_OK(violations);
    for (const std::string& violation : *violations) ADD_FAILURE() << violation;
  }

 private:
  SceneDatabase scene_;
  Retrieval retrieval_;
  Ingest ingest_;
};

JournalRecord LastEntry(const Snapshot& snapshot) {
  JournalRecord last;
  EXPECT_OK(snapshot.ScanJournal(1, [&](const JournalRecord& entry) {
    last = entry;
    return true;
  }));
  return last;
}

TEST(ForbiddenPose, IsTakenAtOnceAndNotGivenAgainUntilItIsAllowed) {
  Stated city;
  city.scene()->AddImages(0, 6);
  ASSERT_EQ(city.scene()->AddReconstruction({0, 1, 2, 3, 4}), kFirst);
  city.Forbid(2);
  const auto snapshot = city.scene()->Snap();
  EXPECT_FALSE(city.HasPose(2));
  EXPECT_TRUE(snapshot->GetObservations(ImageId(2))->empty());
  EXPECT_TRUE(*IsPoseForbidden(*snapshot, ImageId(2)));
  EXPECT_FALSE(*IsPoseForbidden(*snapshot, ImageId(1)));
  const ImageRecord image = *snapshot->GetImage(ImageId(2));
  EXPECT_EQ(image.verdict, Verdict::kPostponed);
  EXPECT_EQ(image.reason, Reason::kForbidden);
  const ReconstructionRecord whole = *snapshot->GetReconstruction(kFirst);
  EXPECT_EQ(whole.image_count, 4u);
  EXPECT_EQ(whole.images_at_adjustment, 0u) << "it is due";
  const JournalRecord entry = LastEntry(*snapshot);
  EXPECT_EQ(entry.actor, "bea");
  EXPECT_EQ(entry.action, "forbid");
  EXPECT_EQ(entry.image, ImageId(2));
  EXPECT_EQ(entry.reconstruction, kFirst);
  EXPECT_EQ(entry.detail, "the pose of image 2: a twin of the tower");
  city.Settle();
  city.Retry(2);
  EXPECT_FALSE(city.HasPose(2)) << "its pairs would place it";
  city.Retry(6);
  EXPECT_TRUE(city.HasPose(6)) << "it touches no other image";
  EXPECT_FALSE(city.HasPose(2)) << "a neighbour has got a pose";
  EXPECT_EQ(city.scene()->Snap()->GetImage(ImageId(2))->reason, Reason::kForbidden);
  city.Allow(2);
  EXPECT_EQ(city.scene()->State().pending_propagation, std::vector{ImageId(2)});
  city.Settle();
  EXPECT_TRUE(city.HasPose(2));
  EXPECT_EQ(city.scene()->Snap()->GetImage(ImageId(2))->reason, Reason::kPropagated);
}

TEST(ForbiddenPose, IsTriedOnceThoughANeighbourWantsItTriedToo) {
  Stated city;
  city.scene()->AddImages(0, 6);
  ASSERT_EQ(city.scene()->AddReconstruction({0, 1, 2, 3, 4}), kFirst);
  city.Forbid(2);
  DatabaseState state = city.scene()->State();
  state.pending_propagation = {ImageId(2)};
  const auto transaction = city.scene()->database()->BeginTransaction();
  transaction->PutState(state);
  ASSERT_OK(transaction->Commit());
  city.Allow(2);
  EXPECT_EQ(city.scene()->State().pending_propagation, std::vector{ImageId(2)});
}

TEST(ForbiddenPose, OncePerPhotoAndOnlyWhereThereCanBeOne) {
  Stated city;
  city.scene()->AddImages(0, 4);
  city.scene()->AddReconstruction({0, 1, 2});
  city.Forbid(4);  // it has no pose
  const uint64_t before = city.scene()->Snap()->sequence();
  city.Forbid(4);
  EXPECT_EQ(city.scene()->Snap()->sequence(), before) << "it is forbidden already";
  EXPECT_EQ(LastEntry(*city.scene()->Snap()).reconstruction, ReconstructionId());
  city.Retry(4);
  EXPECT_FALSE(city.HasPose(4));
  city.Allow(4);
  EXPECT_EQ(Allow(ForbiddenKind::kPose, 4, 4, "", "", Begin(city.scene())).message(),
            "the pose of image 4 is not forbidden");
  CityMap map;
  ImageRecord rejected = *city.scene()->Snap()->GetImage(ImageId(3));
  rejected.verdict = Verdict::kRejected;
  const auto transaction = city.scene()->database()->BeginTransaction();
  transaction->PutImage(rejected);
  ASSERT_OK(transaction->Commit());
  Retrieval retrieval({});
  const IngestOptions options;
  const IngestParts parts{city.scene()->database(), &retrieval, city.scene()->features(),
                          city.scene()->pool(),     options,    &map};
  EXPECT_EQ(ForbidPose(parts, ImageId(3), "", "", Begin(city.scene())).code(),
            StatusCode::kInvalidArgument);
  EXPECT_EQ(ForbidPose(parts, ImageId(9), "", "", Begin(city.scene())).code(),
            StatusCode::kNotFound);
}

TEST(ForbiddenPose, NobodyFoundsWithIt) {
  for (const bool is_forbidden : {false, true}) {
    Stated city;
    city.scene()->AddImages(0, 4);
    if (is_forbidden) city.Forbid(3);
    city.Retry(4);
    EXPECT_EQ(city.HasPose(3), !is_forbidden);
    EXPECT_TRUE(city.HasPose(1) && city.HasPose(2) && city.HasPose(4));
  }
}

TEST(ForbiddenPose, WhatCannotStandWithoutItWaits) {
  Stated city;
  city.scene()->AddImages(0, 3);
  ASSERT_EQ(city.scene()->AddReconstruction({0, 1, 2}), kFirst);
  city.Forbid(1);
  EXPECT_TRUE(city.scene()->Snap()->GetReconstruction(kFirst)->is_dissolved);
  for (const uint32_t id : {2u, 3u}) {
    EXPECT_FALSE(city.HasPose(id));
    EXPECT_EQ(city.scene()->Snap()->GetImage(ImageId(id))->detail,
              "too few points hold it since the pose of image 1 was forbidden");
  }
  city.Settle();
  EXPECT_FALSE(city.HasPose(2)) << "two found no reconstruction";
  city.Allow(1);
  city.Settle();
  EXPECT_TRUE(city.HasPose(1) && city.HasPose(2) && city.HasPose(3));
}

TEST(ForbiddenPose, GoesWithARemovedPhotoAndIsPartOfTheDigest) {
  Stated city;
  city.scene()->AddImages(0, 4);
  const ContentHash before = *DigestOf(*city.scene()->Snap());
  const auto state = [&](const std::string& actor) {
    const auto transaction = city.scene()->database()->BeginTransaction();
    transaction->PutForbidden({ForbiddenKind::kPose, 2, 2, 7, actor, actor});
    EXPECT_OK(transaction->Commit());
    return *DigestOf(*city.scene()->Snap());
  };
  const ContentHash by_bea = state("bea");
  EXPECT_NE(by_bea, before);
  EXPECT_EQ(state("ben"), by_bea) << "who says so does not matter";
  Retrieval retrieval({});
  Ingest ingest(city.scene()->database(), &retrieval, city.scene()->features(),
                city.scene()->pool(), {});
  ASSERT_OK(ingest.Remove(ImageId(2), "anna", ""));
  EXPECT_TRUE(city.scene()->Snap()->ListForbidden()->empty());
}

TEST(ForbiddenPose, VerifyNoticesWhatContradictsIt) {
  Stated city;
  city.scene()->AddImages(0, 3);
  city.scene()->AddReconstruction({0, 1, 2});
  const auto transaction = city.scene()->database()->BeginTransaction();
  transaction->PutForbidden({ForbiddenKind::kPose, 2, 2, 0, "bea", ""});
  transaction->PutForbidden({ForbiddenKind::kPose, 9, 9, 0, "bea", ""});
  ASSERT_OK(transaction->Commit());
  const auto violations = FindViolations(*city.scene()->Snap(), 5);
  ASSERT_OK(violations);
  ASSERT_EQ(violations->size(), 2u);
  EXPECT_EQ(violations->at(0), "image 2 has a pose, and somebody has forbidden it");
  EXPECT_EQ(violations->at(1), "the pose of image 9 is forbidden, and it does not exist");
}

}  // namespace
}  // namespace veduta
