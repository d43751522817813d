// SPDX-License-Identifier: Apache-2.0
// Goal: a larger copy of a stored photo takes the place of its bytes: the image keeps its number,
//   its name, its pose and its points, the old bytes are gone, the journal says so, and the city is
//   sound and the same on any number of threads; what is smaller or another picture changes
//   nothing.
// Method: a city of shrunk photos of a synthetic street, to which the photos themselves are sent.
#include "engine/ingest/better_version.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "engine/camera/orientation.h"
#include "engine/camera/photo_decoder.h"
#include "engine/camera/private_areas.h"
#include "engine/localization/copied_camera.h"
#include "tests/engine/camera/photo_writer.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

constexpr int kPhotos = 8;

std::vector<uint8_t> Halved(const std::vector<uint8_t>& jpeg) {
  cv::Mat picture = DecodePhoto(jpeg, DecodeLimits()).bgr;
  cv::resize(picture, picture, {}, 0.5, 0.5, cv::INTER_AREA);
  std::vector<uint8_t> halved;
  EXPECT_TRUE(cv::imencode(".jpg", picture, halved, {cv::IMWRITE_JPEG_QUALITY, 80}));
  return halved;
}

CameraModel HalfCamera() {
  CameraModel camera = StreetCameraModel();
  camera.width_px /= 2;
  camera.height_px /= 2;
  camera.fx /= 2;
  camera.fy /= 2;
  for (double* center : {&camera.cx, &camera.cy, &camera.u0, &camera.v0})
    *center = (*center + 0.5) / 2 - 0.5;
  return camera;
}

// A database that keeps the better version, of a walk of shrunk photos.
class BetterCity {
 public:
  explicit BetterCity(uint32_t thread_count = 2, int photos = kPhotos) {
    EngineOptions options;
    options.create = true;
    options.sync = false;
    options.thread_count = thread_count;
    options.doubles = Doubles::kBetter;
    auto opened = Engine::Open(folder_ / "db", options);
    EXPECT_OK(opened);
    engine_ = std::move(*opened);
    EXPECT_OK(engine_->AddCamera("street", StreetCameraModel(), ""));
    EXPECT_OK(engine_->AddCamera("half", HalfCamera(), ""));
    for (const Stand& stand : Walk(2, 0.8, photos)) {
      const TakenPhoto& photo = TakePhoto(stand);
      EXPECT_FALSE(Add(photo.name, Halved(photo.jpeg), "half", "anna").duplicate);
    }
  }

  AddOutcome Add(const std::string& name, std::vector<uint8_t> bytes, const std::string& camera,
                 const std::string& contributor) {
    AddOutcome added;
    const PhotoSubmission photo[] = {{{name, name, std::move(bytes)}, camera, contributor}};
    EXPECT_OK(engine_->AddPhotos(
        photo, [&](const AddOutcome& outcome) { added = outcome; }, {},
        [](const FollowUp& step) { EXPECT_OK(step.status); }));
    EXPECT_OK(added.failure);
    return added;
  }
  AddOutcome AddWhole(int i, const std::string& contributor = "bea") {
    const TakenPhoto& photo = TakePhoto(Walk(2, 0.8, kPhotos)[i]);
    return Add("whole " + photo.name, photo.jpeg, "street", contributor);
  }
  CityQuestions Ask() const { return CityQuestions(engine_->Ask()); }
  Engine& engine() { return *engine_; }
  std::string Digest() const { return engine_->Ask().Digest().value(); }
  void ExpectSound() const {
    const auto violations =
        FindViolations(Ask().snapshot(), CheckOptions{.count_max = 5, .deep = true});
    ASSERT_OK(violations);
    for (const std::string& violation : *violations) ADD_FAILURE() << violation;
  }

 private:
  TemporaryFolder folder_;
  std::unique_ptr<Engine> engine_;
};

std::vector<JournalRecord> Replacements(const Snapshot& snapshot) {
  std::vector<JournalRecord> entries;
  EXPECT_OK(snapshot.ScanJournal(1, [&](const JournalRecord& entry) {
    if (entry.action == "replace") entries.push_back(entry);
    return true;
  }));
  return entries;
}

TEST(BetterVersion, TakesThePlaceOfTheBytesAlone) {
  BetterCity city;
  const CityQuestions before = city.Ask();
  const ImageRecord stored = *before.snapshot().GetImage(ImageId(4));
  const PoseRecord pose = before.snapshot().FindPose(ImageId(4))->value();
  const AddOutcome outcome = city.AddWhole(3);
  EXPECT_TRUE(outcome.duplicate && outcome.replaced) << outcome.detail;
  EXPECT_EQ(outcome.id, ImageId(4));
  EXPECT_NE(outcome.detail.find("(#4), at 2 times its width, and takes its place"),
            std::string::npos)
      << outcome.detail;

  const CityQuestions after = city.Ask();
  const Snapshot& snapshot = after.snapshot();
  const std::vector<uint8_t>& whole = TakePhoto(Walk(2, 0.8, kPhotos)[3]).jpeg;
  const ImageRecord image = *snapshot.GetImage(ImageId(4));
  EXPECT_EQ(image.photo, HashContent(whole));
  EXPECT_EQ(image.width_px, StreetCameraModel().width_px);
  EXPECT_EQ(image.size_bytes, whole.size());
  EXPECT_EQ(image.name, stored.name);
  EXPECT_EQ(image.contributor, "anna");
  EXPECT_EQ(image.verdict, stored.verdict);
  EXPECT_GT(image.feature_count, stored.feature_count);
  EXPECT_EQ(snapshot.GetCamera(image.camera)->name, "street");
  EXPECT_EQ(snapshot.GetState()->next_image, kPhotos + 1u);
  // The old bytes are gone, and found by nothing.
  EXPECT_EQ(snapshot.GetPhoto(stored.photo).status().code(), StatusCode::kNotFound);
  EXPECT_EQ(snapshot.GetFeatures(stored.photo).status().code(), StatusCode::kNotFound);
  EXPECT_EQ(*snapshot.FindImageByPhoto(stored.photo), std::nullopt);
  EXPECT_EQ(*snapshot.FindImageByPhoto(image.photo), ImageId(4));
  EXPECT_EQ(*snapshot.FindImageByName("whole " + stored.name, "bea"), std::nullopt);
  // The pose is as good as it was, in the same reconstruction, and is seen by most of the points.
  const PoseRecord now = snapshot.FindPose(ImageId(4))->value();
  EXPECT_EQ(now.reconstruction, pose.reconstruction);
  EXPECT_LT((now.cam_from_world.Center() - pose.cam_from_world.Center()).norm(), 0.05);
  EXPECT_GE(snapshot.GetObservations(ImageId(4))->size(),
            before.snapshot().GetObservations(ImageId(4))->size() / 2);
  EXPECT_GE(snapshot.ListNeighbors(ImageId(4))->size(), 2u);
  const std::vector<JournalRecord> told = Replacements(snapshot);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].actor, "bea");
  EXPECT_EQ(told[0].image, ImageId(4));
  EXPECT_EQ(told[0].detail,
            stored.photo.Hex() + " of 256x192 by " + image.photo.Hex() + " of 512x384");
  city.ExpectSound();
  // Who has asked before sees what was there.
  EXPECT_OK(before.snapshot().GetPhoto(stored.photo).status());
  // What is smaller, and the same bytes, change nothing.
  const std::string digest = city.Digest();
  const AddOutcome smaller = city.Add("again.jpg", Halved(whole), "half", "anna");
  EXPECT_TRUE(smaller.duplicate && !smaller.replaced) << smaller.detail;
  const AddOutcome same = city.AddWhole(3);
  EXPECT_TRUE(same.duplicate && !same.replaced) << same.detail;
  EXPECT_EQ(city.Digest(), digest);
}

TEST(BetterVersion, WhatWasForbiddenOfTheSmallerOneStaysForbidden) {
  BetterCity city;
  ASSERT_OK(city.engine().Forbid({ForbidKind::kPair, "#4", "#5", "bea", "twins"}));
  EXPECT_TRUE(city.AddWhole(3).replaced);
  const auto neighbors = city.Ask().snapshot().ListNeighbors(ImageId(4));
  ASSERT_OK(neighbors);
  EXPECT_FALSE(neighbors->empty());
  EXPECT_TRUE(std::ranges::none_of(
      *neighbors, [](const PairNeighbor& one) { return one.image == ImageId(5); }));
  city.ExpectSound();
}

TEST(BetterVersion, AWholeCityIsExchangedAndGrowsOn) {
  BetterCity city;
  const uint64_t placed = city.Ask().Status()->placed;
  EXPECT_GE(placed, kPhotos - 2u);
  for (int i = 0; i < kPhotos; ++i) EXPECT_TRUE(city.AddWhole(i).replaced) << i;
  EXPECT_EQ(city.Ask().Status()->images, uint64_t{kPhotos});
  EXPECT_GE(city.Ask().Status()->placed, placed);
  city.ExpectSound();
  const TakenPhoto& next = TakePhoto({2 + 0.8 * kPhotos, 90});
  const AddOutcome outcome = city.Add(next.name, next.jpeg, "street", "anna");
  EXPECT_TRUE(outcome.reconstruction.valid()) << outcome.detail;
  EXPECT_OK(city.engine().Settle({}, [](const FollowUp& step) { EXPECT_OK(step.status); }));
  EXPECT_FALSE(city.Ask().snapshot().GetState()->removed_bytes_left) << "the files are rewritten";
  city.ExpectSound();
}

TEST(BetterVersion, IsTheSameOnAnyNumberOfThreads) {
  std::string digest;
  for (const uint32_t threads : {1u, 3u}) {
    BetterCity city(threads);
    for (const int i : {5, 1, 2}) EXPECT_TRUE(city.AddWhole(i).replaced);
    if (digest.empty()) digest = city.Digest();
    EXPECT_EQ(city.Digest(), digest);
  }
}

TEST(BetterVersion, WordsOfBothAreFound) {
  BetterCity city;
  VocabularyRequest request;
  request.branch = 4;
  request.levels = 4;
  ASSERT_OK(city.engine().TrainVocabulary(request));
  const CityQuestions before = city.Ask();
  const uint32_t generation = before.snapshot().GetState()->vocabulary_generation;
  const size_t words = before.snapshot().GetWords(generation, ImageId(2))->size();
  EXPECT_TRUE(city.AddWhole(1).replaced);
  EXPECT_GE(city.Ask().snapshot().GetWords(generation, ImageId(2))->size(), words);
  city.ExpectSound();
  ASSERT_OK(city.engine().TrainVocabulary(request));
  city.ExpectSound();
}

TEST(BetterVersion, APhotoThatWaitsIsExchanged) {
  BetterCity city(2, 1);
  EXPECT_TRUE(city.AddWhole(0).replaced);
  EXPECT_EQ(city.Ask().Status()->postponed, 1u);
  EXPECT_EQ(city.Ask().snapshot().GetImage(ImageId(1))->width_px, 512u);
  city.ExpectSound();
}

TEST(BetterVersion, ItMayHaveTheNameOfTheSmallerOneAndNoOther) {
  BetterCity city;
  const std::vector<Stand> walk = Walk(2, 0.8, kPhotos);
  const TakenPhoto &photo = TakePhoto(walk[2]), &other = TakePhoto({3.7, 75});
  const std::string digest = city.Digest();
  const AddOutcome refused = city.Add(photo.name, other.jpeg, "street", "anna");
  EXPECT_EQ(refused.reason, Reason::kNameTaken) << refused.detail;
  EXPECT_FALSE(refused.id.valid());
  EXPECT_EQ(city.Digest(), digest);
  const AddOutcome taken = city.Add(photo.name, photo.jpeg, "street", "anna");
  EXPECT_TRUE(taken.replaced) << taken.detail;
  EXPECT_EQ(taken.id, ImageId(3));
  city.ExpectSound();
}

TEST(BetterVersion, WhatIsFilledIsNotShownByALargerCopy) {
  BetterCity city(2, 0);
  const TakenPhoto& photo = TakePhoto(Walk(2, 0.8, kPhotos)[0]);
  const std::vector<PixelArea> areas = {{1, 1, 6, 4}};
  std::vector<uint8_t> filled = Halved(photo.jpeg);
  const std::vector<uint8_t> segment = PrivateAreasSegment(areas);
  filled.insert(filled.begin() + 2, segment.begin(), segment.end());
  ASSERT_EQ(ReadPrivateAreas(filled), areas);
  EXPECT_FALSE(city.Add(photo.name, filled, "half", "anna").duplicate);
  const std::string digest = city.Digest();
  const AddOutcome shown = city.AddWhole(0);
  EXPECT_TRUE(shown.duplicate);
  EXPECT_FALSE(shown.replaced);
  EXPECT_NE(shown.detail.find("private areas"), std::string::npos) << shown.detail;
  EXPECT_EQ(city.Digest(), digest);
  // A larger copy in which they are filled, too, may take its place.
  std::vector<uint8_t> whole = photo.jpeg;
  whole.insert(whole.begin() + 2, segment.begin(), segment.end());
  EXPECT_TRUE(city.Add("whole", whole, "street", "bea").replaced);
  city.ExpectSound();
}

// A messenger sends a phone's photo upright and small; then comes the photo itself, with the
// sensor's pixels.
TEST(BetterVersion, ItMayBeTurned) {
  BetterCity city;
  const CityQuestions before = city.Ask();
  const PoseRecord pose = before.snapshot().FindPose(ImageId(4))->value();
  const TakenPhoto& photo = TakePhoto(Walk(2, 0.8, kPhotos)[3]);
  const cv::Mat lying = Upright(DecodePhoto(photo.jpeg, DecodeLimits()).bgr, InverseOrientation(6));
  std::vector<uint8_t> whole;
  ASSERT_TRUE(cv::imencode(".jpg", lying, whole, {cv::IMWRITE_JPEG_QUALITY, 95}));
  whole = testing::WithExif(whole, testing::ExifBlock(6, true));
  ASSERT_OK(city.engine().AddCamera(
      "lying", CameraOfCopy(StreetCameraModel(), 1, ImageSize{384, 512}, 6), ""));
  const AddOutcome outcome = city.Add("phone.jpg", whole, "lying", "bea");
  EXPECT_TRUE(outcome.replaced) << outcome.detail;
  const CityQuestions after = city.Ask();
  const PoseRecord now = after.snapshot().FindPose(ImageId(4))->value();
  EXPECT_EQ(after.snapshot().GetImage(ImageId(4))->orientation, 6);
  EXPECT_LT((now.cam_from_world.Center() - pose.cam_from_world.Center()).norm(), 0.05);
  const Rigid3 upright =
      Rigid3{Eigen::Quaterniond(UprightCamFromStoredCam(6)), Eigen::Vector3d::Zero()} *
      now.cam_from_world;
  EXPECT_LT(upright.rotation.angularDistance(pose.cam_from_world.rotation), 0.01);
  EXPECT_GE(after.snapshot().GetObservations(ImageId(4))->size(),
            before.snapshot().GetObservations(ImageId(4))->size() / 2);
  city.ExpectSound();
}

TEST(BetterVersion, HasMorePixels) {
  ImageRecord stored, other;
  stored.width_px = other.width_px = 400;
  stored.height_px = other.height_px = 300;
  EXPECT_FALSE(IsLarger(other, stored));
  ++other.width_px;
  EXPECT_TRUE(IsLarger(other, stored));
  EXPECT_FALSE(IsLarger(stored, other));
}

}  // namespace
}  // namespace veduta
