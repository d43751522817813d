// SPDX-License-Identifier: Apache-2.0
// Goal: photos are added without anybody naming their camera: near where they were taken, with one
//   camera for those that say that one camera took them, the same on any number of threads; one
//   that fits nowhere is told so and not stored.
// Method: a walk along a rendered street; half of its photos are added with the true camera, the
//   others without, as they are and with EXIF.
#include "engine/unnamed_camera.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "tests/engine/camera/exif_writer.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

const ExifCamera kPhone{"Maker", "Phone", "", 5.5, 0};
constexpr const char* kGroup = "Maker Phone, 5.5 mm, 512x384";

PhotoSubmission WithoutCamera(const Stand& stand) {
  const TakenPhoto& photo = TakePhoto(stand);
  return {{photo.name, photo.name, photo.jpeg}, "", "anna"};
}

PhotoSubmission WithExif(const Stand& stand) {
  PhotoSubmission photo = WithoutCamera(stand);
  photo.photo.bytes = testing::WithExif(*photo.photo.bytes, testing::ExifOf(kPhone));
  return photo;
}

// Every second photo of a walk is added with its camera, and the others are told.
std::vector<Stand> AddHalf(City* city) {
  std::vector<Stand> named, others;
  const std::vector<Stand> walk = Walk(5, 0.5, 16);
  for (size_t i = 0; i + 1 < walk.size(); ++i) (i % 2 == 0 ? named : others).push_back(walk[i]);
  city->Add(named);
  return others;
}

// Of all placed photos of the walk.
double WorstCenterErrorM(const City& city) {
  const std::vector<Stand> walk = Walk(5, 0.5, 16);
  const PoseErrors errors = CompareWithTruth(city.Ask().snapshot(), ReconstructionId(1), walk);
  EXPECT_EQ(errors.count, walk.size() - 1);
  return errors.center_m_max;
}

double FocalOf(const City& city, const std::string& camera) {
  const auto found = city.Ask().door().Camera(camera);
  EXPECT_OK(found);
  return found.ok() ? found->model.fx : 0;
}

TEST(UnnamedCamera, EachPhotoThatSaysNothingHasACameraOfItsOwn) {
  City city;
  std::vector<PhotoSubmission> photos;
  for (const Stand& stand : AddHalf(&city)) photos.push_back(WithoutCamera(stand));
  std::set<std::string> cameras;
  for (const AddOutcome& outcome : city.Add(photos)) {
    EXPECT_EQ(outcome.verdict, Verdict::kPlaced) << outcome.detail << outcome.failure.message();
    EXPECT_EQ(outcome.camera.substr(0, 10), "estimated ");
    EXPECT_NEAR(FocalOf(city, outcome.camera) / StreetCameraModel().fx, 1, 0.02);
    cameras.insert(outcome.camera);
  }
  EXPECT_EQ(cameras.size(), photos.size());
  EXPECT_LT(WorstCenterErrorM(city), 0.1);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  for (const AddOutcome& again : city.Add(photos)) EXPECT_TRUE(again.duplicate);
  // Removed, one is added anew, and its camera is estimated anew.
  RemoveRequest request;
  request.photos = {photos[0].photo.name};
  ASSERT_OK(city.engine().Remove(request));
  const AddOutcome anew = city.Add({photos[0]}).front();
  EXPECT_EQ(anew.verdict, Verdict::kPlaced) << anew.detail << anew.failure.message();
  EXPECT_FALSE(cameras.contains(anew.camera)) << anew.camera;
}

// A part of the photo's middle, as large as the photo: the focal length is so many times as long.
PhotoSubmission Enlarged(const Stand& stand, double times) {
  const TakenPhoto& taken = TakePhoto(stand);
  const cv::Mat photo = cv::imdecode(taken.jpeg, cv::IMREAD_COLOR);
  const cv::Size size(static_cast<int>(photo.cols / times), static_cast<int>(photo.rows / times));
  const cv::Rect middle({(photo.cols - size.width) / 2, (photo.rows - size.height) / 2}, size);
  cv::Mat enlarged;
  cv::resize(photo(middle), enlarged, photo.size(), 0, 0, cv::INTER_CUBIC);
  std::vector<uint8_t> bytes;
  cv::imencode(".png", enlarged, bytes);
  return {{taken.name, taken.name, bytes}, "", "anna"};
}

TEST(UnnamedCamera, PhotosThatSayNothingHaveTheCameraThatSuchPhotosHaveTold) {
  City city;
  std::vector<Stand> walk = Walk(5, 0.8, 17);
  for (size_t i = 1; i < walk.size(); i += 3) walk[i].yaw_deg += 20;
  std::vector<PhotoSubmission> first;
  for (size_t i = 0; i < 13; ++i) first.push_back(WithoutCamera(walk[i]));
  ASSERT_OK(city.engine().CalibrateFirst(first));
  city.Add(first);
  ASSERT_GE(city.Counts().placed, 12u);
  const auto before = city.Ask().door().Cameras();
  ASSERT_OK(before);
  ASSERT_EQ(before->size(), 2u) << "with that of the fixture";
  EXPECT_EQ(before->back().name, "photos of 512x384");
  for (const size_t i : {13u, 14u}) {
    const AddOutcome outcome = city.Add({WithoutCamera(walk[i])}).front();
    EXPECT_EQ(outcome.verdict, Verdict::kPlaced) << outcome.detail << outcome.failure.message();
    EXPECT_EQ(outcome.camera, "photos of 512x384");
  }
  EXPECT_EQ(city.Ask().door().Cameras()->size(), 2u);
  const AddOutcome other = city.Add({Enlarged(Stand{8.9, 105}, 1.15)}).front();
  EXPECT_EQ(other.verdict, Verdict::kPlaced) << other.detail << other.failure.message();
  EXPECT_EQ(other.camera.substr(0, 10), "estimated ");
  EXPECT_NEAR(FocalOf(city, other.camera) / StreetCameraModel().fx, 1.15, 0.03);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

TEST(UnnamedCamera, WhatComesTooEarlyIsTriedAgainAfterTheOthers) {
  City city;
  const std::vector<Stand> walk = Walk(5, 0.5, 12);
  std::vector<PhotoSubmission> photos = {WithoutCamera(Stand{45, 270}), WithoutCamera(walk[5])};
  for (size_t i = 0; i < walk.size(); ++i) {
    if (i != 5) photos.push_back(city.Submit(walk[i]));
  }
  const std::vector<AddOutcome> outcomes = city.Add(photos);
  ASSERT_EQ(outcomes.size(), photos.size());
  for (size_t i = 0; i + 2 < outcomes.size(); ++i)
    EXPECT_EQ(outcomes[i].name, photos[i + 2].photo.name) << "in their order";
  const AddOutcome &early = outcomes[outcomes.size() - 2], &nowhere = outcomes.back();
  EXPECT_EQ(early.name, photos[1].photo.name);
  EXPECT_EQ(early.verdict, Verdict::kPlaced) << early.detail << early.failure.message();
  EXPECT_EQ(nowhere.name, photos[0].photo.name);
  EXPECT_EQ(nowhere.failure.code(), StatusCode::kNotFound);
}

TEST(UnnamedCamera, TheOrderIsTheSameWhereAddingWasInterrupted) {
  std::string digests[2];
  for (const bool is_interrupted : {false, true}) {
    City city;
    const std::vector<Stand> walk = Walk(5, 0.5, 12);
    std::vector<PhotoSubmission> photos = {WithoutCamera(Stand{45, 270}), WithoutCamera(walk[5])};
    for (size_t i = 0; i < walk.size(); ++i) {
      if (i != 5) photos.push_back(city.Submit(walk[i]));
    }
    if (is_interrupted) {
      std::stop_source stop;
      size_t added = 0;
      const auto report = [&](const AddOutcome&) {
        if (++added == 8) stop.request_stop();
      };
      EXPECT_EQ(city.engine().AddPhotos(photos, report, stop.get_token()).code(),
                StatusCode::kCancelled);
      EXPECT_LT(city.Counts().placed, 11u);
      city.Open();
    }
    city.Add(photos);
    EXPECT_EQ(city.Counts().placed, 12u);
    digests[is_interrupted] = city.Digest();
  }
  EXPECT_EQ(digests[0], digests[1]);
}

TEST(UnnamedCamera, NamesThatAreTakenAreLeftAlone) {
  City city;
  std::vector<PhotoSubmission> photos;
  for (const Stand& stand : AddHalf(&city)) photos.push_back(WithoutCamera(stand));
  CameraModel other = StreetCameraModel();
  other.fx = 1;
  ASSERT_OK(city.engine().AddCamera("estimated 3", other, "by hand"));
  const AddOutcome outcome = city.Add({photos[0]}).front();
  EXPECT_EQ(outcome.camera, "estimated 3 (2)") << outcome.detail << outcome.failure.message();
}

TEST(UnnamedCamera, PhotosThatSayTheSameHaveOneAndTheOrderAloneDecides) {
  std::string digests[2];
  for (const uint32_t threads : {1, 3}) {
    City city(City::Options(threads));
    std::vector<PhotoSubmission> photos;
    for (const Stand& stand : AddHalf(&city)) photos.push_back(WithExif(stand));
    // From the first one on that tells the focal length well.
    bool is_settled = false;
    for (const AddOutcome& outcome : city.Add(photos)) {
      EXPECT_EQ(outcome.verdict, Verdict::kPlaced) << outcome.detail << outcome.failure.message();
      is_settled = is_settled || outcome.camera == kGroup;
      EXPECT_EQ(outcome.camera == kGroup, is_settled) << outcome.camera;
    }
    EXPECT_TRUE(is_settled);
    EXPECT_NEAR(FocalOf(city, kGroup) / StreetCameraModel().fx, 1, 0.01);
    EXPECT_LT(WorstCenterErrorM(city), 0.1);
    digests[threads / 2] = city.Digest();
  }
  EXPECT_EQ(digests[0], digests[1]);
}

TEST(UnnamedCamera, WhatFitsNowhereIsToldAndNotStored) {
  City city;
  const std::vector<Stand> walk = Walk(5, 0.5, 2);
  const AddOutcome nowhere = city.Add({WithoutCamera(walk[0])}).front();
  EXPECT_EQ(nowhere.failure.code(), StatusCode::kNotFound) << nowhere.failure.message();
  EXPECT_NE(nowhere.failure.message().find("Name its camera"), std::string::npos);
  const std::string text = "no photo";
  const AddOutcome rejected =
      city.Add({{{"text.jpg", "", std::vector<uint8_t>(text.begin(), text.end())}, "", "anna"}})
          .front();
  EXPECT_EQ(rejected.verdict, Verdict::kRejected);
  EXPECT_OK(rejected.failure);
  EXPECT_FALSE(rejected.id.valid());
  const AddOutcome gone = city.Add({{{"gone.jpg", "gone.jpg", {}}, "", "anna"}}).front();
  EXPECT_EQ(gone.failure.code(), StatusCode::kNotFound);
  EXPECT_NE(gone.failure.message().find("gone.jpg"), std::string::npos);
  EXPECT_EQ(city.Counts().images, 0u);
  const auto ticket = city.engine().Submit(WithoutCamera(walk[1]));
  ASSERT_OK(ticket);
  EXPECT_EQ(ticket->Wait().status().code(), StatusCode::kNotFound);
}

}  // namespace
}  // namespace veduta
