// SPDX-License-Identifier: Apache-2.0
// Goal: a city that is made anew from its photos is sound and has all of them, under their names.
//   What people have forbidden of photos holds in it, and what cannot be kept is told.
// Method: the photos of a whole street database are added to a new one.
#include "engine/repair/rebuilding.h"

#include <algorithm>

#include "engine/parts.h"
#include "tests/engine/repair/damaged_city.h"

namespace veduta {
namespace {

// A city that is rebuilt from a copy of the street.
struct Rebuilt {
  explicit Rebuilt(const DamagedCity& city) {
    const auto source = Salvage::Open(city.path(), city.folder() / "links", {});
    EXPECT_OK(source);
    UndistortCache tables(64 << 20);
    const PhotoPreparer preparer(nullptr, &tables, PrepareOptions());
    HealingWork examined(**source, preparer, nullptr, {});
    EXPECT_OK(HealAll(&examined));
    EngineOptions options;
    options.create = true;
    options.thread_count = 2;
    auto opened = Engine::Open(city.folder() / "new", options);
    EXPECT_OK(opened);
    engine = std::move(*opened);
    auto told = RebuildFromPhotos(examined, engine.get());
    EXPECT_OK(told);
    unkept = *told;
    const auto violations = engine->Ask().Verify({.count_max = 20});
    EXPECT_OK(violations);
    EXPECT_EQ(*violations, std::vector<std::string>());
  }

  std::unique_ptr<Engine> engine;
  std::vector<RepairNotes::Finding> unkept;
};

std::string NameOf(int photo) {
  return TakePhoto(Walk(4, 1.2, kStreetPhotos)[static_cast<size_t>(photo)]).name;
}

TEST(Rebuilding, AddsEveryPhotoUnderItsName) {
  const DamagedCity city;
  const Rebuilt rebuilt(city);
  EXPECT_TRUE(rebuilt.unkept.empty());
  for (int photo = 0; photo < kStreetPhotos; ++photo) {
    const auto image = rebuilt.engine->Ask().Image(NameOf(photo));
    ASSERT_OK(image);
    EXPECT_EQ(image->contributor, "anna");
    EXPECT_NE(image->verdict, Verdict::kRejected);
  }
}

TEST(Rebuilding, KeepsThePhotosThatWait) {
  const DamagedCity city;
  {
    const auto database = Database::Open(city.path(), {});
    ASSERT_OK(database);
    UploadRecord upload;
    upload.number = 40;
    upload.name = "waiting.jpg";
    upload.photo = HashContent(SampleBytes(1, 500));
    ASSERT_OK((*database)->AddUpload(upload, SampleBytes(1, 500)));
  }
  const Rebuilt rebuilt(city);
  const auto uploads = rebuilt.engine->Ask().Uploads();
  ASSERT_OK(uploads);
  ASSERT_EQ(uploads->size(), 1u);
  EXPECT_EQ(uploads->front().number, 40u);
  EXPECT_EQ(uploads->front().name, "waiting.jpg");
}

TEST(Rebuilding, KeepsWhatIsForbiddenOfPhotosAndTellsOfMerges) {
  const DamagedCity city;
  {
    const auto database = Database::Open(city.path(), {});
    ASSERT_OK(database);
    const auto transaction = (*database)->BeginTransaction();
    transaction->PutForbidden({ForbiddenKind::kPair, 2, 3, 7, "bea", "two towers"});
    transaction->PutForbidden({ForbiddenKind::kMerge, 1, 2, 8, "ben", "two rivers"});
    transaction->PutForbidden({ForbiddenKind::kPose, 5, 5, 9, "cleo", "the wrong tower"});
    ASSERT_OK(transaction->Commit());
  }
  const Rebuilt rebuilt(city);
  const auto forbidden = rebuilt.engine->Ask().Forbidden();
  ASSERT_OK(forbidden);
  ASSERT_EQ(forbidden->size(), 2u);
  EXPECT_EQ(forbidden->at(0).kind, ForbidKind::kPair);
  EXPECT_EQ(forbidden->at(0).name_a, NameOf(1));
  EXPECT_EQ(forbidden->at(0).name_b, NameOf(2));
  EXPECT_EQ(forbidden->at(0).actor, "bea");
  EXPECT_EQ(forbidden->at(0).reason, "two towers");
  EXPECT_EQ(forbidden->at(1).kind, ForbidKind::kPose);
  EXPECT_EQ(forbidden->at(1).name_a, NameOf(4));
  EXPECT_FALSE(rebuilt.engine->Ask().Image(NameOf(4))->reconstruction.valid());
  EXPECT_TRUE(rebuilt.engine->Ask().Image(NameOf(3))->reconstruction.valid());
  ASSERT_EQ(rebuilt.unkept.size(), 1u);
  EXPECT_EQ(rebuilt.unkept[0].damage,
            "ben has forbidden that reconstructions 1 and 2 are merged: two rivers");
}

TEST(Rebuilding, KeepsHiddenWhatWasHidden) {
  const DamagedCity city;
  {
    const auto database = Database::Open(city.path(), {});
    ASSERT_OK(database);
    const auto transaction = (*database)->BeginTransaction();
    transaction->PutHidden({HiddenKind::kImage, 5, 9, "kai", "it shows a home"});
    transaction->PutHidden({HiddenKind::kImage, 99, 9, "kai", "of no photo"});
    ReportRecord report;
    report.number = 1;
    report.image = ImageId(2);
    transaction->PutReport(report);
    ASSERT_OK(transaction->Commit());
  }
  const Rebuilt rebuilt(city);
  const auto hidden = rebuilt.engine->Ask().Hidden();
  ASSERT_OK(hidden);
  ASSERT_EQ(hidden->size(), 1u);
  EXPECT_EQ(hidden->front().name, NameOf(4));
  EXPECT_EQ(hidden->front().actor, "kai");
  EXPECT_EQ(hidden->front().reason, "it shows a home");
  ASSERT_EQ(rebuilt.unkept.size(), 1u);
  EXPECT_EQ(rebuilt.unkept[0].damage, "1 reports of photos are stored");
}

TEST(Rebuilding, KeepsWhatIsSealed) {
  const DamagedCity city;
  const std::vector<uint8_t> original = SampleBytes(1, 500);
  {
    const auto database = Database::Open(city.path(), {});
    ASSERT_OK(database);
    const auto transaction = (*database)->BeginTransaction();
    transaction->SealOriginal(ImageId(5), original);
    ASSERT_OK(transaction->Commit());
  }
  const Rebuilt rebuilt(city);
  EXPECT_TRUE(rebuilt.unkept.empty());
  const auto image = rebuilt.engine->Ask().Image(NameOf(4));
  ASSERT_OK(image);
  const auto snapshot = EngineParts::Of(*rebuilt.engine).database->GetSnapshot();
  const auto sealed = snapshot->GetOriginal(image->id);
  ASSERT_OK(sealed);
  EXPECT_TRUE(std::ranges::equal(sealed->bytes(), original));
  EXPECT_EQ(*snapshot->FindImageByPhoto(HashContent(original)), image->id);
}

TEST(Rebuilding, KeepsTokensAndTellsOfSurveyedPoints) {
  const DamagedCity city;
  {
    const auto database = Database::Open(city.path(), {});
    ASSERT_OK(database);
    const auto transaction = (*database)->BeginTransaction();
    transaction->PutGroundPoint({"corner", {47, 15, 300}, 0.05, {{ImageId(5), 1, 2}}});
    transaction->PutToken({4, "anna", Role::kCurator, {7}, 5, 0, 0, {}});
    ASSERT_OK(transaction->Commit());
  }
  const Rebuilt rebuilt(city);
  const auto tokens = rebuilt.engine->Ask().Tokens();
  ASSERT_OK(tokens);
  ASSERT_EQ(tokens->size(), 1u);
  EXPECT_EQ(tokens->front().number, 4u);
  EXPECT_EQ(tokens->front().name, "anna");
  ASSERT_EQ(rebuilt.unkept.size(), 1u);
  EXPECT_EQ(rebuilt.unkept[0].damage, "1 surveyed points are stored");
  EXPECT_NE(rebuilt.unkept[0].remedy.find("veduta georeference"), std::string::npos);
}

}  // namespace
}  // namespace veduta
