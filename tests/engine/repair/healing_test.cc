// SPDX-License-Identifier: Apache-2.0
// Goal: what a healing leaves out is damaged, not only unreadable at the moment; surfaces that are
//   not finished come along, and so do hypotheses about what is there, and what people forbid.
// Method: one street database is healed into a new one, record by record; once with a disk whose
//   reads fail.
#include "engine/repair/healing.h"

#include <filesystem>
#include <memory>
#include <optional>

#include "storage/records/earth_record.h"
#include "storage/records/hypothesis_record.h"
#include "storage/records/token_record.h"
#include "tests/engine/repair/damaged_city.h"
#include "tests/storage/fault_file_system.h"

namespace veduta {
namespace {

// A new database, healed from the closed one at the path.
struct Healed {
  explicit Healed(const std::filesystem::path& path) {
    auto opened = Salvage::Open(path, folder / "links", {});
    EXPECT_OK(opened);
    source = std::move(*opened);
    DatabaseOptions create;
    create.create = true;
    auto made = Database::Open(folder / "new", create);
    EXPECT_OK(made);
    target = std::move(*made);
    healing.emplace(*source, preparer, target.get(), HealOptions());
    EXPECT_OK(HealAll(&*healing));
  }

  const TemporaryFolder folder;
  UndistortCache tables{64 << 20};
  const PhotoPreparer preparer{nullptr, &tables, PrepareOptions()};
  std::unique_ptr<Salvage> source;
  std::unique_ptr<Database> target;
  std::optional<HealingWork> healing;
};

TEST(Healing, TellsDamageFromFailuresOfTheMachine) {
  EXPECT_TRUE(IsDamage(Status::Corruption("block checksum mismatch")));
  EXPECT_TRUE(IsDamage(Status::NotFound("no such key")));
  EXPECT_TRUE(IsDamage(Status::IoError("IO error: No such file or directory: While open 7.blob")));
  EXPECT_FALSE(IsDamage(Status::IoError("IO error: Too many open files: While open 7.blob")));
  EXPECT_FALSE(IsDamage(Status::IoError("IO error: Input/output error: While pread 7.blob")));
}

TEST(Healing, EndsWhereTheDiskDoesNotAnswer) {
  const DamagedCity city;
  const auto disk = std::make_shared<FaultFileSystem>();
  DatabaseOptions options;
  options.file_system = disk;
  const auto source = Salvage::Open(city.path(), city.folder() / "links", options);
  ASSERT_OK(source);
  UndistortCache tables(64 << 20);
  const PhotoPreparer preparer(nullptr, &tables, PrepareOptions());
  HealingWork healing(**source, preparer, nullptr, {});
  disk->Fail(Only(Operation::kRead), 1, Fault::kIoError, FaultFileSystem::kForever);
  EXPECT_EQ(HealAll(&healing).code(), StatusCode::kIoError);
  EXPECT_EQ(healing.notes.lost, std::vector<std::string>());
}

TEST(Healing, TakesUnfinishedSurfacesAlong) {
  const DamagedCity city;
  const ReconstructionId own(1), staged = StagedSurfaceOf(own);
  {
    const auto database = Database::Open(city.path(), {});
    ASSERT_OK(database);
    const auto transaction = (*database)->BeginTransaction();
    for (const ReconstructionId surface : {own, staged}) {
      transaction->dense().PutSettings({surface, surface == own ? 0.2 : 0.4, 96, 2});
      TileRecord tile;
      tile.reconstruction = surface;
      tile.place = {1, 2, 3};
      transaction->dense().PutTile(tile);
    }
    ASSERT_OK(transaction->Commit());
  }
  const Healed healed(city.path());
  ASSERT_TRUE(healed.healing->IsLiving(own));
  const auto snapshot = healed.target->GetSnapshot();
  for (const ReconstructionId surface : {own, staged}) {
    const auto settings = snapshot->dense().FindSettings(surface);
    ASSERT_OK(settings);
    ASSERT_TRUE(settings->has_value()) << surface.value;
    EXPECT_EQ((*settings)->voxel_size, surface == own ? 0.2 : 0.4);
    const auto tile = snapshot->dense().FindTile(surface, {1, 2, 3});
    ASSERT_OK(tile);
    EXPECT_TRUE(tile->has_value()) << surface.value;
  }
}

HypothesisRecord HypothesisOf(uint32_t a, uint32_t b, std::vector<ImageId> images) {
  HypothesisRecord hypothesis;
  hypothesis.a = ReconstructionId(a);
  hypothesis.b = ReconstructionId(b);
  hypothesis.image = images.back();
  hypothesis.images = std::move(images);
  return hypothesis;
}

// A closed database with two reconstructions, of images 1 to 4 and 5 to 8, and these hypotheses.
void MakeTwo(City* city, const std::vector<HypothesisRecord>& hypotheses) {
  city->Add(Walk(4, 1.2, 4));
  city->Add(Walk(30, 1.2, 4));
  ASSERT_EQ(city->Counts().reconstructions.size(), 2u);
  const auto transaction = city->parts().database->BeginTransaction();
  for (const HypothesisRecord& hypothesis : hypotheses) transaction->PutHypothesis(hypothesis);
  ASSERT_OK(transaction->Commit());
  city->Close();
}

// What a healing of the city makes of its hypotheses, and what it notes.
std::pair<std::vector<HypothesisRecord>, RepairNotes> HealedHypotheses(const City& city) {
  const Healed healed(city.path());
  const auto snapshot = healed.target->GetSnapshot();
  const auto violations = FindViolations(*snapshot, 9);
  EXPECT_OK(violations);
  EXPECT_EQ(*violations, std::vector<std::string>());
  return {*snapshot->ListHypotheses(), healed.healing->notes};
}

TEST(Healing, TakesHypothesesAlong) {
  City city;
  MakeTwo(&city, {HypothesisOf(1, 2, {ImageId(2), ImageId(5)})});
  const auto [all, notes] = HealedHypotheses(city);
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].images, (std::vector{ImageId(2), ImageId(5)}));
  EXPECT_EQ(all[0].image, ImageId(5));
  EXPECT_FALSE(all[0].is_due);
  EXPECT_TRUE(notes.findings.empty());
}

TEST(Healing, MendsAHypothesisThatNamesWhatIsNotThere) {
  City city;
  MakeTwo(&city, {HypothesisOf(1, 2, {ImageId(2), ImageId(99)}), HypothesisOf(1, 9, {ImageId(2)})});
  const auto [all, notes] = HealedHypotheses(city);
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].b, ReconstructionId(2));
  EXPECT_EQ(all[0].images, std::vector{ImageId(2)});
  EXPECT_FALSE(all[0].image.valid());
  EXPECT_TRUE(all[0].is_due);
  ASSERT_EQ(notes.findings.size(), 2u);
  EXPECT_EQ(notes.findings[0].damage, "1 hypotheses name photos that are not there");
  EXPECT_EQ(notes.findings[1].damage, "1 hypotheses are of what is not there");
}

TEST(Healing, LosesHypothesesThatCannotBeReadAndNothingElse) {
  City city;
  MakeTwo(&city, {HypothesisOf(1, 2, {ImageId(2)})});
  WithRocksdb(
      city.path(),
      [&](rocksdb::DB& db, rocksdb::ColumnFamilyHandle* handle) {
        const std::string key = HypothesisKey(ReconstructionId(1), ReconstructionId(2));
        ASSERT_TRUE(db.Put({}, handle, key, "garbage").ok());
      },
      Family::kMeta);
  const auto [all, notes] = HealedHypotheses(city);
  EXPECT_TRUE(all.empty());
  ASSERT_EQ(notes.findings.size(), 1u);
  EXPECT_TRUE(notes.findings[0].damage.starts_with("the hypotheses cannot be read"));
}

TEST(Healing, TakesAForbiddenPoseAlongAndNoPoseBesideIt) {
  const DamagedCity city;
  {
    const auto database = Database::Open(city.path(), {});
    ASSERT_OK(database);
    const auto transaction = (*database)->BeginTransaction();
    transaction->PutForbidden({ForbiddenKind::kPose, 5, 5, 9, "cleo", "the wrong tower"});
    transaction->PutForbidden({ForbiddenKind::kPose, 99, 99, 9, "cleo", "of no photo"});
    ASSERT_OK(transaction->Commit());
  }
  const Healed healed(city.path());
  const auto snapshot = healed.target->GetSnapshot();
  EXPECT_TRUE(IsSound(*snapshot));
  const auto forbidden = snapshot->ListForbidden();
  ASSERT_OK(forbidden);
  ASSERT_EQ(forbidden->size(), 1u);
  EXPECT_EQ(forbidden->front().a, 5u);
  EXPECT_EQ(forbidden->front().reason, "the wrong tower");
  EXPECT_FALSE(snapshot->FindPose(ImageId(5))->has_value());
  const std::string told = "image 5) is stored, and somebody has forbidden it";
  EXPECT_TRUE(
      std::ranges::any_of(healed.healing->notes.findings, [&](const RepairNotes::Finding& one) {
        return one.damage.ends_with(told) && one.remedy == "it is left out";
      }));
}

TEST(Healing, TakesSurveyedPointsAndTokensAlong) {
  const DamagedCity city;
  {
    const auto database = Database::Open(city.path(), {});
    ASSERT_OK(database);
    const auto transaction = (*database)->BeginTransaction();
    transaction->PutGroundPoint(
        {"corner", {47, 15, 300}, 0.05, {{ImageId(5), 1, 2}, {ImageId(99), 3, 4}}});
    transaction->PutToken({1, "anna", Role::kCurator, {7}, 5, 0, 0, {}});
    ASSERT_OK(transaction->Commit());
  }
  const Healed healed(city.path());
  const auto snapshot = healed.target->GetSnapshot();
  EXPECT_TRUE(IsSound(*snapshot));
  const std::vector<GroundPoint> wanted = {{"corner", {47, 15, 300}, 0.05, {{ImageId(5), 1, 2}}}};
  EXPECT_EQ(*snapshot->ListGroundPoints(), wanted);
  const auto tokens = snapshot->ListTokens();
  ASSERT_OK(tokens);
  ASSERT_EQ(tokens->size(), 1u);
  EXPECT_EQ(tokens->front().name, "anna");
  EXPECT_EQ(tokens->front().hash[0], 7);
}

TEST(Healing, LosesSurveyedPointsAndTokensThatCannotBeRead) {
  const DamagedCity city;
  WithRocksdb(
      city.path(),
      [&](rocksdb::DB& db, rocksdb::ColumnFamilyHandle* handle) {
        ASSERT_TRUE(db.Put({}, handle, GroundPointKey("corner"), "garbage").ok());
        ASSERT_TRUE(db.Put({}, handle, TokenKey(1), "garbage").ok());
      },
      Family::kMeta);
  const Healed healed(city.path());
  const auto snapshot = healed.target->GetSnapshot();
  EXPECT_TRUE(IsSound(*snapshot));
  EXPECT_TRUE(snapshot->ListGroundPoints()->empty());
  EXPECT_TRUE(snapshot->ListTokens()->empty());
  for (const char* told : {"the surveyed points cannot be read", "the tokens cannot be read"}) {
    EXPECT_TRUE(std::ranges::any_of(
        healed.healing->notes.findings,
        [&](const RepairNotes::Finding& one) { return one.damage.starts_with(told); }))
        << told;
  }
}

}  // namespace
}  // namespace veduta
