// SPDX-License-Identifier: Apache-2.0
// Goal: what the city answers is what its records say: counts, images, neighbours, cameras and the
//   journal; who asks for what is not there is told what there is.
// Method: a street of a few photos, one of them spoilt, goes through the engine; each answer is
//   compared with a walk over the records themselves.
#include "engine/query/city_answers.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

// One city for all tests: they only ask.
class CityAnswersTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    city_ = std::make_unique<City>();
    std::vector<PhotoSubmission> photos;
    for (const Stand& stand : Walk(6, 0.9, 5)) photos.push_back(city_->Submit(stand));
    photos.push_back(city_->Submit("letter.jpg", {'n', 'o', ' ', 'p', 'h', 'o', 't', 'o'}));
    city_->Add(photos);
  }
  static void TearDownTestSuite() { city_.reset(); }

  void SetUp() override {
    ASSERT_OK(snapshot_->ScanImages([&](const ImageRecord& image) {
      images_.push_back(image);
      return true;
    }));
    ASSERT_EQ(images_.size(), 6u);
  }

  size_t Count(Verdict verdict) const {
    return static_cast<size_t>(std::ranges::count(images_, verdict, &ImageRecord::verdict));
  }
  std::vector<JournalAnswer> Journal(uint64_t first, uint32_t count_max) const {
    auto entries = JournalOf(*snapshot_, first, count_max);
    EXPECT_OK(entries);
    return entries.ok() ? std::move(*entries) : std::vector<JournalAnswer>();
  }

  static std::unique_ptr<City> city_;
  const std::shared_ptr<const Snapshot> snapshot_ = city_->parts().database->GetSnapshot();
  std::vector<ImageRecord> images_;
  UnsureCache unsure_;
};

std::unique_ptr<City> CityAnswersTest::city_;

TEST_F(CityAnswersTest, StatusCountsWhatAWalkOverTheImagesCounts) {
  DatabaseSizes sizes;
  sizes.total_bytes = 3, sizes.photo_bytes = 2, sizes.feature_bytes = 1;
  const auto status = StatusOf(*snapshot_, sizes, &unsure_);
  ASSERT_OK(status);
  EXPECT_EQ(status->images, images_.size());
  EXPECT_EQ(status->rejected, Count(Verdict::kRejected));
  EXPECT_EQ(status->rejected, 1u);
  EXPECT_EQ(status->postponed, Count(Verdict::kPostponed));
  uint64_t posed = 0, observations = 0;
  for (const ImageRecord& image : images_) {
    posed += snapshot_->FindPose(image.id)->has_value();
    observations += snapshot_->GetObservations(image.id)->size();
  }
  EXPECT_EQ(status->placed, posed);
  EXPECT_EQ(posed, 5u);
  EXPECT_EQ(status->cameras, 1u);
  EXPECT_EQ(status->backlog, 0u);
  ASSERT_EQ(status->reconstructions.size(), 1u);
  const ReconstructionAnswer& one = status->reconstructions.front();
  EXPECT_EQ(one.images, posed);
  EXPECT_EQ(one.observations, observations);
  EXPECT_GT(one.points, 100u);
  EXPECT_GT(one.reprojection_error_px_mean, 0);
  EXPECT_FALSE(one.merged_into.valid());
  EXPECT_EQ(one.depth_maps + one.tiles + one.triangles, 0u) << "no dense pass has run";
  EXPECT_EQ(status->total_bytes, 3u);
  EXPECT_EQ(status->photo_bytes, 2u);
  EXPECT_EQ(status->feature_bytes, 1u);
}

TEST_F(CityAnswersTest, AnImagesAnswerIsWhatItsRecordsSay) {
  for (const ImageRecord& image : images_) {
    SCOPED_TRACE(image.name);
    const auto answer = ImageAnswerOf(*snapshot_, image, &unsure_);
    ASSERT_OK(answer);
    EXPECT_EQ(answer->id, image.id);
    EXPECT_EQ(answer->name, image.name);
    EXPECT_EQ(answer->verdict, image.verdict);
    EXPECT_EQ(answer->reason, image.reason);
    EXPECT_EQ(answer->detail, image.detail);
    EXPECT_EQ(answer->camera, image.camera);
    EXPECT_EQ(answer->width_px, image.width_px);
    EXPECT_EQ(answer->height_px, image.height_px);
    EXPECT_EQ(answer->size_bytes, image.size_bytes);
    EXPECT_EQ(answer->sha256, image.photo.Hex());
    EXPECT_EQ(answer->contributor, "anna");
    EXPECT_EQ(answer->time_unix_s, image.time_unix_s);
    EXPECT_EQ(answer->features, image.feature_count);
    EXPECT_EQ(answer->observations, snapshot_->GetObservations(image.id)->size());
    EXPECT_FALSE(answer->depth_map);
    const auto pose = snapshot_->FindPose(image.id);
    ASSERT_OK(pose);
    ASSERT_EQ(answer->cam_from_world.has_value(), pose->has_value());
    EXPECT_EQ(answer->reconstruction.valid(), pose->has_value());
    if (!*pose) continue;
    EXPECT_EQ(answer->reconstruction, (*pose)->reconstruction);
    const Rigid3& cam_from_world = (*pose)->cam_from_world;
    EXPECT_EQ(answer->cam_from_world->rotation_wxyz[0], cam_from_world.rotation.w());
    EXPECT_EQ(answer->cam_from_world->translation[2], cam_from_world.translation.z());
    EXPECT_EQ(answer->cam_from_world->center[1], cam_from_world.Center().y());
  }
}

TEST_F(CityAnswersTest, NeighborsComeByTheirMatchesThenById) {
  for (const ImageRecord& image : images_) {
    SCOPED_TRACE(image.name);
    const auto neighbors = NeighborsOf(*snapshot_, image.id);
    ASSERT_OK(neighbors);
    const auto pairs = snapshot_->ListNeighbors(image.id);
    ASSERT_OK(pairs);
    ASSERT_EQ(neighbors->size(), pairs->size());
    EXPECT_EQ(neighbors->empty(), image.verdict == Verdict::kRejected);
    EXPECT_TRUE(
        std::ranges::is_sorted(*neighbors, [](const NeighborAnswer& a, const NeighborAnswer& b) {
          return a.matches != b.matches ? a.matches > b.matches : a.image < b.image;
        }));
    for (const NeighborAnswer& neighbor : *neighbors) {
      const auto pair = std::ranges::find(*pairs, neighbor.image, &PairNeighbor::image);
      ASSERT_NE(pair, pairs->end());
      EXPECT_EQ(neighbor.matches, pair->match_count);
      const auto record = snapshot_->GetImage(neighbor.image);
      ASSERT_OK(record);
      EXPECT_EQ(neighbor.name, record->name);
      EXPECT_EQ(neighbor.verdict, record->verdict);
      EXPECT_EQ(neighbor.score, 0);
    }
  }
}

TEST_F(CityAnswersTest, TheJournalIsReadFromAnyEntryAndNoFartherThanAsked) {
  const std::vector<JournalAnswer> all = Journal(1, 1000);
  ASSERT_GE(all.size(), images_.size());
  for (size_t i = 0; i < all.size(); ++i) EXPECT_EQ(all[i].sequence, i + 1);
  EXPECT_EQ(std::ranges::count(all, "add", &JournalAnswer::action), 6);
  EXPECT_EQ(Journal(1, 2).size(), 2u);
  EXPECT_TRUE(Journal(1, 0).empty());
  const std::vector<JournalAnswer> from_third = Journal(3, 1000);
  ASSERT_EQ(from_third.size(), all.size() - 2);
  EXPECT_EQ(from_third.front().sequence, 3u);
  EXPECT_EQ(from_third.front().actor, all[2].actor);
  EXPECT_EQ(from_third.front().detail, all[2].detail);
  EXPECT_TRUE(Journal(all.size() + 1, 1000).empty());
}

TEST_F(CityAnswersTest, ACameraIsFoundByItsNameOrThoseThereAreAreNamed) {
  const auto found = FindCamera(*snapshot_, "street");
  ASSERT_OK(found);
  const auto cameras = CamerasOf(*snapshot_);
  ASSERT_OK(cameras);
  ASSERT_EQ(cameras->size(), 1u);
  EXPECT_EQ(cameras->front().id, found->id);
  EXPECT_EQ(cameras->front().name, "street");
  EXPECT_EQ(cameras->front().source, "the truth");
  EXPECT_EQ(cameras->front().model.fx, StreetCameraModel().fx);
  const Status unknown = FindCamera(*snapshot_, "stret").status();
  EXPECT_EQ(unknown.code(), StatusCode::kNotFound);
  EXPECT_EQ(unknown.message(), "there is no camera 'stret'; the database has: street");
  const TemporaryFolder folder;
  const Status none = FindCamera(*MustCreate(folder / "db")->GetSnapshot(), "street").status();
  EXPECT_EQ(none.message(), "there is no camera 'street'; add one with `veduta camera add`");
}

TEST(Hypotheses, AreListedByIdsAndTheStatusHasThoseWithMostPoints) {
  const TemporaryFolder folder;
  const auto database = MustCreate(folder / "db");
  const auto transaction = database->BeginTransaction();
  for (uint32_t b = 2; b <= 26; ++b) {
    HypothesisRecord hypothesis;
    hypothesis.a = ReconstructionId(b < 20 ? 1 : 4);
    hypothesis.b = ReconstructionId(b);
    hypothesis.common_point_count = b % 5;
    hypothesis.agreeing_pairs = 3;
    hypothesis.contradicting_pairs = 4;
    hypothesis.agreeing_matches = 50;
    hypothesis.contradicting_matches = 60;
    hypothesis.judged_cells = 9;
    hypothesis.missing_cells = 8;
    hypothesis.a_from_b.scale = 2;
    hypothesis.a_from_b.translation = {1, 2, 3};
    hypothesis.image = ImageId(b);
    hypothesis.images = {ImageId(b)};
    hypothesis.judgment_count = 7;
    hypothesis.is_due = b == 2;
    hypothesis.time_unix_s = 1000 + b;
    transaction->PutHypothesis(hypothesis);
  }
  ASSERT_OK(transaction->Commit());
  const auto snapshot = database->GetSnapshot();
  const auto all = HypothesesOf(*snapshot, {});
  ASSERT_OK(all);
  ASSERT_EQ(all->size(), 25u);
  const HypothesisAnswer& first = all->front();
  EXPECT_EQ(first.a, ReconstructionId(1));
  EXPECT_EQ(first.b, ReconstructionId(2));
  EXPECT_EQ(first.common_points, 2u);
  EXPECT_EQ(first.pairs_for, 3u);
  EXPECT_EQ(first.pairs_against, 4u);
  EXPECT_EQ(first.matches_for, 50u);
  EXPECT_EQ(first.matches_against, 60u);
  EXPECT_EQ(first.parts_judged, 9u);
  EXPECT_EQ(first.parts_missing, 8u);
  EXPECT_EQ(first.scale, 2);
  EXPECT_EQ(first.pose.translation, (std::array<double, 3>{1, 2, 3}));
  EXPECT_EQ(first.image, ImageId(2));
  EXPECT_EQ(first.judgments, 7u);
  EXPECT_TRUE(first.due);
  EXPECT_FALSE(all->back().due);
  EXPECT_EQ(first.time_unix_s, 1002);
  EXPECT_NE(first.reason.find("3 pairs agree"), std::string::npos) << first.reason;
  EXPECT_EQ(HypothesesOf(*snapshot, ReconstructionId(4))->size(), 8u) << "on either side";
  EXPECT_TRUE(HypothesesOf(*snapshot, ReconstructionId(40))->empty());
  UnsureCache unsure;
  const auto status = StatusOf(*snapshot, {}, &unsure);
  ASSERT_OK(status);
  EXPECT_EQ(status->open_hypotheses, 25u);
  ASSERT_EQ(status->doubtful_seams.size(), kDoubtfulSeamsMax);
  EXPECT_EQ(status->doubtful_seams.front().b, ReconstructionId(4));
  EXPECT_EQ(status->doubtful_seams.front().common_points, 4u);
  EXPECT_EQ(status->doubtful_seams.back().common_points, 1u);
}

}  // namespace
}  // namespace veduta
