// SPDX-License-Identifier: Apache-2.0
// Goal: whatever is damaged, a repair tells it without changing anything, and then makes a sound
//   database that has every photo whose bytes are whole; what is lost is named; a repair that is
//   killed is finished by the next one.
// Method: one street database is copied and damaged in each way: bits of tables, of blobs, whole
//   files, records that contradict each other. Where all that is damaged can be derived, the digest
//   has to be the one from before.
#include "engine/repair/repair.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

#include "engine/repair/repair_folders.h"
#include "storage/log_reader.h"
#include "storage/records/forbidden_record.h"
#include "storage/records/image_record.h"
#include "storage/records/pair_record.h"
#include "storage/records/photo_record.h"
#include "storage/records/point_block.h"
#include "storage/records/pose_record.h"
#include "storage/records/reconstruction_record.h"
#include "tests/engine/repair/damaged_city.h"

namespace veduta {
namespace {

std::string Told(const RepairAnswer& answer) {
  std::string text;
  for (const RepairFinding& finding : answer.findings)
    text += finding.damage + "; " + finding.remedy + "\n";
  for (const std::string& name : answer.lost) text += "lost " + name + "\n";
  for (const std::string& name : answer.retried) text += "retried " + name + "\n";
  return text;
}

// Every file of the folder with its bytes.
std::map<std::string, std::string> Contents(const std::string& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (entry.is_regular_file() && name != "LOCK") files[entry.path()] = FileBytes(entry.path());
  }
  return files;
}

RepairAnswer Repaired(const std::string& path, bool apply, bool may_rebuild = false) {
  const Result<RepairAnswer> answer =
      Engine::Repair(path, {.apply = apply, .thread_count = 2, .may_rebuild = may_rebuild});
  EXPECT_OK(answer);
  return answer.ok() ? *answer : RepairAnswer();
}

// What a repaired database has to be.
struct Whole {
  std::string digest;
  uint64_t photos = 0, placed = 0;
};

Whole Look(const std::string& path) {
  Whole whole;
  EngineOptions options;
  options.thread_count = 2;
  auto engine = Engine::Open(path, options);
  EXPECT_OK(engine);
  if (!engine.ok()) return whole;
  const Questions questions = (*engine)->Ask();
  const auto violations = questions.Verify({.count_max = 20});
  EXPECT_OK(violations);
  if (violations.ok()) {
    EXPECT_EQ(*violations, std::vector<std::string>());
  }
  const auto status = questions.Status();
  EXPECT_OK(status);
  if (status.ok()) {
    whole.photos = status->placed + status->postponed;
    whole.placed = status->placed;
  }
  const auto digest = questions.Digest();
  EXPECT_OK(digest);
  if (digest.ok()) whole.digest = *digest;
  // Adding goes on: the photo is one that nobody has sent yet.
  const TakenPhoto& photo = TakePhoto({4 + 1.2 * kStreetPhotos, 90});
  AddOutcome added;
  EXPECT_OK((*engine)->AddPhotos(
      std::vector<PhotoSubmission>{{{photo.name, "", photo.jpeg}, "street", "anna"}},
      [&](const AddOutcome& outcome) { added = outcome; }));
  EXPECT_NE(added.verdict, Verdict::kRejected) << added.detail;
  return whole;
}

// Tells the damage without changing anything, then repairs.
Whole RepairAndLook(const DamagedCity& city, RepairAnswer* answer, bool may_rebuild = false) {
  const auto before = Contents(city.folder().path());
  const RepairAnswer told = Repaired(city.path(), false);
  EXPECT_FALSE(told.is_sound);
  EXPECT_FALSE(told.findings.empty());
  EXPECT_TRUE(before == Contents(city.folder().path())) << "a repair without --yes changed files";
  *answer = Repaired(city.path(), true, may_rebuild);
  EXPECT_TRUE(answer->is_repaired) << Told(*answer);
  EXPECT_TRUE(may_rebuild || !answer->is_rebuilt) << Told(*answer);
  EXPECT_TRUE(std::filesystem::exists(answer->kept_path));
  EXPECT_TRUE(std::filesystem::exists(answer->report_path));
  EXPECT_EQ(answer->lost, told.lost);
  return Look(city.path());
}

// All photos are there.
Whole ExpectNothingLost(const DamagedCity& city, bool may_rebuild = false) {
  RepairAnswer answer;
  const Whole whole = RepairAndLook(city, &answer, may_rebuild);
  EXPECT_EQ(answer.lost, std::vector<std::string>()) << Told(answer);
  EXPECT_EQ(whole.photos, kStreetPhotos) << Told(answer);
  return whole;
}

TEST(Repair, LeavesASoundDatabaseAlone) {
  const DamagedCity city;
  const auto before = Contents(city.folder().path());
  const RepairAnswer answer = Repaired(city.path(), true);
  EXPECT_TRUE(answer.is_sound) << Told(answer);
  EXPECT_FALSE(answer.is_repaired);
  EXPECT_TRUE(before == Contents(city.folder().path()));
}

TEST(Repair, SaysWhereThereIsNoDatabase) {
  const TemporaryFolder folder;
  EXPECT_EQ(Engine::Repair(folder / "none", {}).status().code(), StatusCode::kNotFound);
}

TEST(Repair, LeavesAFolderAloneThatIsNoDatabase) {
  const TemporaryFolder folder;
  const std::filesystem::path photos = folder / "photos";
  std::filesystem::create_directory(photos);
  std::ofstream(photos / "a.jpg") << "a photo";
  RepairRequest request;
  request.apply = true;
  const auto answer = Engine::Repair(photos, request);
  EXPECT_EQ(answer.status().code(), StatusCode::kNotFound);
  EXPECT_NE(answer.status().message().find("not a veduta database"), std::string::npos);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(photos), {}), 1);
}

TEST(Repair, RefusesARequestOutsideItsBounds) {
  const TemporaryFolder folder;
  EXPECT_EQ(Engine::Repair(folder / "none", {.thread_count = 1025}).status().message(),
            "RepairRequest.thread_count is 1025, but must be from 0 to 1024");
}

TEST(Repair, WaitsForNobodyWhoHasTheDatabaseOpen) {
  const DamagedCity city;
  const auto engine = Engine::Open(city.path());
  ASSERT_OK(engine);
  EXPECT_EQ(Engine::Repair(city.path(), {}).status().code(), StatusCode::kBusy);
}

// A family whose records follow from others: the city is the same afterwards.
class DerivedFamily : public testing::TestWithParam<Family> {};

TEST_P(DerivedFamily, IsDerivedAgain) {
  const DamagedCity city;
  city.DamageTables(GetParam());
  EXPECT_EQ(ExpectNothingLost(city).digest, city.digest());
}

INSTANTIATE_TEST_SUITE_P(Repair, DerivedFamily,
                         testing::Values(Family::kNames, Family::kHashes, Family::kWords,
                                         Family::kPostings, Family::kObservations, Family::kJournal,
                                         Family::kCameras, Family::kFeatures),
                         [](const auto& info) { return std::string(FamilyName(info.param)); });

// A family that is not the same afterwards, without a photo being lost.
class RecoveredFamily : public testing::TestWithParam<Family> {};

TEST_P(RecoveredFamily, LosesNoPhoto) {
  const DamagedCity city;
  city.DamageTables(GetParam());
  // Where no pose is left, there is no reconstruction to go on from.
  EXPECT_GE(ExpectNothingLost(city, GetParam() == Family::kPoses).placed, 3u);
}

INSTANTIATE_TEST_SUITE_P(Repair, RecoveredFamily,
                         testing::Values(Family::kMeta, Family::kImages, Family::kPairs,
                                         Family::kReconstructions, Family::kPoses, Family::kPoints,
                                         Family::kVocabulary, Family::kPhotos),
                         [](const auto& info) { return std::string(FamilyName(info.param)); });

TEST(Repair, ComputesDamagedFeaturesAgain) {
  const DamagedCity city;
  const auto snapshot = WholeCity().Ask();
  const auto image = snapshot.snapshot().GetImage(ImageId(2));
  ASSERT_OK(image);
  const auto features = snapshot.snapshot().GetFeatures(image->photo);
  ASSERT_OK(features);
  const auto value = Encode(*features);
  ASSERT_OK(value);
  city.DamageBlob(value->substr(0, 3000));
  EXPECT_EQ(ExpectNothingLost(city).digest, city.digest());
}

TEST(Repair, NamesAPhotoWhoseBytesAreDamaged) {
  const DamagedCity city;
  const TakenPhoto& photo = TakePhoto(Walk(4, 1.2, kStreetPhotos)[3]);
  city.DamagePhoto(photo.jpeg);
  RepairAnswer answer;
  const Whole whole = RepairAndLook(city, &answer);
  EXPECT_EQ(answer.lost, std::vector<std::string>{photo.name});
  EXPECT_NE(FileBytes(answer.report_path).find(photo.name), std::string::npos);
  EXPECT_EQ(whole.photos, kStreetPhotos - 1);
  // The file can be added again under its name.
  auto engine = Engine::Open(city.path());
  ASSERT_OK(engine);
  AddOutcome added;
  ASSERT_OK((*engine)->AddPhotos(
      std::vector<PhotoSubmission>{{{photo.name, "", photo.jpeg}, "street", "anna"}},
      [&](const AddOutcome& outcome) { added = outcome; }));
  EXPECT_EQ(added.verdict, Verdict::kPlaced) << added.detail;
}

TEST(Repair, PiecesFilesTogetherWithoutAManifest) {
  for (const char* prefix : {"CURRENT", "MANIFEST-"}) {
    const DamagedCity city;
    for (const auto& entry : std::filesystem::directory_iterator(city.path())) {
      if (entry.path().filename().string().starts_with(prefix))
        std::filesystem::remove(entry.path());
    }
    ExpectNothingLost(city);
  }
}

TEST(Repair, FindsWhatLiesInLogsAlone) {
  City city;
  city.Add(Walk(4, 1.2, 3));
  const std::string path = city.path();
  city.Close();
  for (const auto& entry : std::filesystem::directory_iterator(path)) {
    if (entry.path().filename().string().starts_with("MANIFEST-"))
      std::filesystem::remove(entry.path());
  }
  const RepairAnswer answer = Repaired(path, true);
  EXPECT_TRUE(answer.is_repaired);
  EXPECT_EQ(Look(path).photos, 3u) << Told(answer);
}

TEST(Repair, BringsBackPhotosOfOneNameThatWereNotCommitted) {
  City city;
  city.Add(Walk(4, 1.2, 3));
  const std::string path = city.path();
  city.Close();
  {
    const auto database = MustOpen(path, {});
    for (const Stand& stand : Walk(7.6, 1.2, 2)) {
      const std::vector<uint8_t>& jpeg = TakePhoto(stand).jpeg;
      ASSERT_OK(database->WritePhotoAhead(HashContent(jpeg), jpeg, SampleFeatures(1, 3),
                                          {"twice.jpg", "anna"}));
    }
  }
  for (const auto& entry : std::filesystem::directory_iterator(path)) {
    if (entry.path().filename().string().starts_with("MANIFEST-"))
      std::filesystem::remove(entry.path());
  }
  const RepairAnswer answer = Repaired(path, true);
  EXPECT_TRUE(answer.is_repaired);
  EXPECT_EQ(Look(path).photos, 5u) << Told(answer);
  EXPECT_NE(Told(answer).find("added again as 'twice.jpg'"), std::string::npos) << Told(answer);
  EXPECT_NE(Told(answer).find("added again as 'recovered/"), std::string::npos) << Told(answer);
}

// A closed database whose records are in its log alone.
class LogCity {
 public:
  LogCity() {
    City city;
    city.Add(stands_);
    city.Close();
    std::filesystem::copy(city.path(), path());
    for (const std::string& file : FilesWith(path(), ".log")) {
      if (log_.empty() || FileBytes(file).size() > FileBytes(log_).size()) log_ = file;
    }
    EXPECT_OK(ReadLog(*rocksdb::FileSystem::Default(), log_, [&](const LogPiece& piece) {
      pieces_.push_back({piece.begin_bytes, piece.end_bytes, PhotosIn(piece.record)});
      return Status::Ok();
    }));
  }

  struct Piece {
    uint64_t begin_bytes, end_bytes;  // in the log
    uint32_t photos;                  // in it, with all their bytes
  };
  const std::vector<Piece>& pieces() const { return pieces_; }
  uint32_t photo_count() const { return static_cast<uint32_t>(stands_.size()); }

  // How many of the photos a repair of a copy keeps, each under its name.
  template <typename Damage>
  uint64_t KeptAfter(Damage&& damage) const {
    const TemporaryFolder folder;
    std::filesystem::copy(path(), folder / "db");
    damage(folder / ("db/" + std::filesystem::path(log_).filename().string()));
    EXPECT_FALSE(Engine::Open(folder / "db").ok());
    const RepairAnswer answer = Repaired(folder / "db", true);
    EXPECT_TRUE(answer.is_repaired) << Told(answer);
    EXPECT_EQ(Told(answer).find("recovered/"), std::string::npos) << Told(answer);
    // Where the camera is lost, all photos lie in the folder.
    return answer.written_out.size() + (answer.is_rebuilt ? 0 : Look(folder / "db").photos);
  }

 private:
  std::string path() const { return folder_ / "db"; }
  uint32_t PhotosIn(std::string_view record) const {
    return static_cast<uint32_t>(std::ranges::count_if(stands_, [&](const Stand& stand) {
      const std::vector<uint8_t>& jpeg = TakePhoto(stand).jpeg;
      return record.find(std::string(jpeg.begin(), jpeg.end())) != std::string_view::npos;
    }));
  }

  const std::vector<Stand> stands_ = Walk(4, 1.2, 3);
  TemporaryFolder folder_;
  std::string log_;
  std::vector<Piece> pieces_;
};

TEST(Repair, LosesThePhotoOfADamagedRecordAlone) {
  const LogCity city;
  uint32_t with_photo = 0;
  for (const LogCity::Piece& piece : city.pieces()) {
    const uint64_t middle = (piece.begin_bytes + piece.end_bytes) / 2;
    const uint64_t kept = city.KeptAfter([&](const std::string& log) { FlipByte(log, middle); });
    EXPECT_GE(kept, city.photo_count() - piece.photos) << "byte " << middle;
    with_photo += piece.photos;
  }
  EXPECT_EQ(with_photo, city.photo_count());
}

TEST(Repair, BringsBackPhotosWhoseCommitsAreCutOff) {
  const LogCity city;
  uint32_t whole = 0;
  for (const LogCity::Piece& piece : city.pieces()) {
    whole += piece.photos;
    if (whole == 0) continue;  // the camera is not there yet
    if (piece.end_bytes == city.pieces().back().end_bytes) break;
    const uint64_t kept = city.KeptAfter(
        [&](const std::string& log) { std::filesystem::resize_file(log, piece.end_bytes); });
    EXPECT_EQ(kept, whole) << "cut at byte " << piece.end_bytes;
  }
}

TEST(Repair, RecoversImagesFromTheirIndexes) {
  const DamagedCity city;
  city.DeleteTables(Family::kImages);
  ExpectNothingLost(city);
}

TEST(Repair, LeavesOutWhatContradictsItself) {
  const DamagedCity city;
  // A track that names an image of another number, an image twice, a pose of nobody.
  const auto whole = WholeCity().Ask();
  const auto pose = whole.snapshot().FindPose(ImageId(1));
  ASSERT_OK(pose);
  PoseRecord stray = pose->value();
  stray.image = ImageId(77);
  city.Overwrite(Family::kPoses, ImageKey(stray.image), *Encode(stray));
  city.Overwrite(Family::kObservations, ImageKey(ImageId(2)), "");
  EXPECT_EQ(ExpectNothingLost(city).digest, city.digest());
}

TEST(Repair, LeavesOutAPairThatItsGeometryDoesNotExplain) {
  const DamagedCity city;
  const auto whole = WholeCity().Ask();
  auto pair = whole.snapshot().GetPair(ImageId(1), ImageId(2));
  ASSERT_OK(pair);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY()));
  pair->b_from_a.rotation = turn * pair->b_from_a.rotation;
  city.Overwrite(Family::kPairs, PairKey(pair->a, pair->b), *Encode(*pair));
  ExpectNothingLost(city);
}

TEST(Repair, MeasuresAPointAgainThatRecordsAnotherError) {
  const DamagedCity city;
  const auto whole = WholeCity().Ask();
  const auto map = whole.snapshot().ListReconstructions();
  ASSERT_OK(map);
  const ReconstructionRecord& record = map->front();
  auto block = whole.snapshot().GetPointBlock(record.id, record.points_generation, ImageId(1));
  ASSERT_OK(block);
  ASSERT_FALSE(block->points.empty());
  block->points.front().error_px += 0.125f;
  city.Overwrite(Family::kPoints, PointBlockKey(record.id, record.points_generation, block->home),
                 *Encode(*block));
  EXPECT_EQ(ExpectNothingLost(city).placed, kStreetPhotos);
}

// A living reconstruction that says how it was moved into another: no step mends that.
TEST(Repair, RebuildsWhereItMay) {
  const DamagedCity city;
  auto map = WholeCity().Ask().snapshot().ListReconstructions();
  ASSERT_OK(map);
  ReconstructionRecord record = map->front();
  record.merged_from_this.scale = 2;
  city.Overwrite(Family::kReconstructions, ReconstructionKey(record.id), *Encode(record));
  const auto before = Contents(city.folder().path());
  const Status refused = Engine::Repair(city.path(), {.apply = true, .thread_count = 2}).status();
  EXPECT_EQ(refused.code(), StatusCode::kCorruption);
  EXPECT_NE(refused.message().find("--rebuild"), std::string::npos) << refused.message();
  EXPECT_TRUE(before == Contents(city.folder().path()))
      << "it was rebuilt, and nobody asked for it";
  RepairAnswer answer;
  const ForbiddenRecord merge{ForbiddenKind::kMerge, 1, 2, 0, "bea", ""};
  city.Overwrite(Family::kMeta, ForbiddenKey(merge.kind, merge.a, merge.b), *Encode(merge));
  EXPECT_EQ(RepairAndLook(city, &answer, /*may_rebuild=*/true).photos, kStreetPhotos);
  EXPECT_TRUE(answer.is_rebuilt);
  EXPECT_EQ(answer.findings.back().damage,
            "bea has forbidden that reconstructions 1 and 2 are merged");
}

TEST(Repair, KnowsADatabaseByAnyPathThatLeadsToIt) {
  const DamagedCity city;
  city.DamageTables(Family::kWords);
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(city.path());
  const RepairAnswer answer = Repaired(".", true);
  std::filesystem::current_path(before);
  EXPECT_TRUE(answer.is_repaired);
  EXPECT_EQ(answer.kept_path, RepairFoldersFor(city.path()).database + ".damaged-1");
  EXPECT_EQ(Look(city.path()).digest, city.digest());
}

TEST(Repair, IsFinishedAfterAKillAtAnyStep) {
  for (const RepairStep last :
       {RepairStep::kSourceLinked, RepairStep::kExamined, RepairStep::kWritten,
        RepairStep::kComplete, RepairStep::kMovedAway}) {
    const DamagedCity city;
    city.DamageTables(Family::kWords);
    const auto killed = RunRepair(city.path(), {.apply = true, .thread_count = 2},
                                  [&](RepairStep step) { return step != last; });
    ASSERT_EQ(killed.status().code(), StatusCode::kCancelled);
    if (last == RepairStep::kMovedAway) {
      EXPECT_TRUE(std::filesystem::exists(city.path())) << "an instant without a database";
    }
    Repaired(city.path(), true);
    EXPECT_TRUE(std::filesystem::exists(city.path() + ".damaged-1"));
    EXPECT_EQ(Look(city.path()).digest, city.digest());
    for (const auto& entry : std::filesystem::directory_iterator(city.folder().path()))
      EXPECT_EQ(entry.path().string().find(".repair"), std::string::npos) << entry.path();
  }
}

}  // namespace
}  // namespace veduta
