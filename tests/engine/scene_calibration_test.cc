// SPDX-License-Identifier: Apache-2.0
// Goal: photos of any place say what their camera is, to a fraction of a percent, the same on any
//   number of threads, and those of several cameras what each of them is; a city begins with photos
//   whose camera nobody names; what cannot be told is refused with what to do.
// Method: photos of a rendered street, whose camera is known, with EXIF and without, and resized.
#include "engine/scene_calibration.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "engine/first_cameras.h"
#include "tests/engine/camera/exif_writer.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

// Near and far, along two sides.
std::vector<Stand> Around(size_t count) {
  std::vector<Stand> stands = Walk(5, 0.8, static_cast<int>(count));
  for (size_t i = 1; i < stands.size(); i += 3) stands[i].yaw_deg += 20;
  return stands;
}

std::vector<PhotoSource> Sources(const std::vector<Stand>& stands) {
  std::vector<PhotoSource> photos;
  for (const Stand& stand : stands) {
    const TakenPhoto& photo = TakePhoto(stand);
    photos.push_back({photo.name, photo.name, photo.jpeg});
  }
  return photos;
}

std::vector<PhotoSubmission> WithoutCamera(const std::vector<Stand>& stands) {
  std::vector<PhotoSubmission> photos;
  for (PhotoSource& photo : Sources(stands)) photos.push_back({std::move(photo), "", "anna"});
  return photos;
}

void ExpectStreetCamera(const CameraModel& model) {
  const CameraModel truth = StreetCameraModel();
  EXPECT_NEAR(model.fx / truth.fx, 1, 0.01);
  EXPECT_EQ(model.fx, model.fy);
  EXPECT_NEAR(model.cx, truth.cx, 0.02 * truth.width_px);
  EXPECT_NEAR(model.cy, truth.cy, 0.02 * truth.width_px);
  EXPECT_NEAR(model.k1, 0, 0.03);
}

TEST(SceneCalibration, PhotosOfAStreetTellTheirCamera) {
  const std::vector<PhotoSource> photos = Sources(Around(14));
  const Result<Calibration> made = CalibrateByScene(photos, 2);
  ASSERT_OK(made);
  ExpectStreetCamera(made->model);
  EXPECT_LT(made->Sigma(0) / made->model.fx, 0.02);
  EXPECT_GT(made->Sigma(0), 0);
  EXPECT_GE(made->UsedPhotoCount(), 12u);
  EXPECT_EQ(made->photos.size(), photos.size());
  EXPECT_LT(made->error_px_rms, 1);
  EXPECT_NEAR(made->focal_search_px / StreetCameraModel().fx, 1, 0.2);
  const Result<Calibration> alone = CalibrateByScene(photos, 1);
  ASSERT_OK(alone);
  EXPECT_EQ(alone->model, made->model);
}

TEST(SceneCalibration, SaysWhatCannotBeTold) {
  const std::vector<PhotoSource> photos = Sources(Around(3));
  const Result<Calibration> few = CalibrateByScene(photos, 1);
  EXPECT_EQ(few.status().code(), StatusCode::kInvalidArgument);
  EXPECT_NE(few.status().message().find("ten or more"), std::string::npos);

  std::vector<PhotoSource> with_text = photos;
  with_text.push_back({"notes.txt", "notes.txt", std::vector<uint8_t>(100, 'a')});
  const Result<Calibration> no_photo = CalibrateByScene(with_text, 1);
  EXPECT_NE(no_photo.status().message().find("notes.txt: "), std::string::npos)
      << no_photo.status().message();

  EXPECT_EQ(CalibrateByScene({}, 1).status().code(), StatusCode::kInvalidArgument);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(CalibrateByScene(Sources(Around(6)), 1, stop.get_token()).status().code(),
            StatusCode::kCancelled);
}

TEST(SceneCalibration, WrongOptionsAreNamed) {
  EXPECT_OK(SceneCalibrationOptions().Check());
  const auto refused = [](const char* name, auto&& change) {
    SceneCalibrationOptions options;
    change(&options);
    EXPECT_NE(options.Check().message().find(name), std::string::npos) << name;
    EXPECT_EQ(CalibrateByScene({}, 1, {}, options).status().code(), StatusCode::kInvalidArgument);
  };
  refused("photos_max", [](SceneCalibrationOptions* o) { o->photos_max = 3; });
  refused("rounds_max", [](SceneCalibrationOptions* o) { o->rounds_max = 0; });
  refused("rest_share", [](SceneCalibrationOptions* o) { o->rest_share = 0; });
  refused("told_focal_shares", [](SceneCalibrationOptions* o) { o->told_focal_shares = {-1}; });
  refused("scan.count", [](SceneCalibrationOptions* o) { o->scan.count = 0; });
}

TEST(FirstCameras, ACityBeginsWithPhotosWhoseCameraNobodyNames) {
  City city;
  std::vector<PhotoSubmission> photos = WithoutCamera(Around(14));
  PhotoSubmission named = city.Submit(Stand{4.6, 90});
  photos.push_back(named);
  const auto cameras = city.engine().CalibrateFirst(photos);
  ASSERT_OK(cameras);
  ASSERT_EQ(cameras->size(), 1u);
  const FirstCamera& first = cameras->front();
  ASSERT_EQ(first.name, "photos of 512x384") << first.why_not;
  EXPECT_EQ(first.photos, 14u);
  ExpectStreetCamera(first.model);
  EXPECT_GT(first.focal_stddev_share, 0);
  for (size_t i = 0; i < 14; ++i) EXPECT_EQ(photos[i].camera, first.name);
  EXPECT_EQ(photos.back().camera, "street");
  const auto stored = city.Ask().door().Camera(first.name);
  ASSERT_OK(stored);
  EXPECT_EQ(stored->model, first.model);
  EXPECT_NE(stored->source.find("calibrated by 1"), std::string::npos) << stored->source;

  // Another list before anything is placed: its camera has a name of its own.
  std::vector<PhotoSubmission> others = WithoutCamera(Walk(5.3, 0.8, 14));
  const auto again = city.engine().CalibrateFirst(others);
  ASSERT_OK(again);
  ASSERT_EQ(again->size(), 1u);
  EXPECT_EQ(again->front().name, "photos of 512x384 (2)") << again->front().why_not;

  city.Add(photos);
  EXPECT_GE(city.Counts().placed, 13u) << "of 15";
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  // What is placed says where others are, and with what camera.
  std::vector<PhotoSubmission> later = WithoutCamera(Walk(5.3, 0.8, 8));
  const auto none = city.engine().CalibrateFirst(later);
  ASSERT_OK(none);
  EXPECT_TRUE(none->empty());
}

TEST(FirstCameras, PhotosThatSayTheSameAreOneGroup) {
  City city;
  const ExifCamera phone{"Maker", "Phone", "", 5.5, 0};
  std::vector<PhotoSubmission> photos = WithoutCamera(Around(14));
  for (PhotoSubmission& photo : photos)
    photo.photo.bytes = testing::WithExif(*photo.photo.bytes, testing::ExifOf(phone));
  for (const Stand& stand : Walk(30, 0.8, 3)) photos.push_back(WithoutCamera({stand}).front());
  const auto cameras = city.engine().CalibrateFirst(photos);
  ASSERT_OK(cameras);
  ASSERT_EQ(cameras->size(), 1u) << "three photos are too few";
  EXPECT_EQ(cameras->front().name, "Maker Phone, 5.5 mm, 512x384") << cameras->front().why_not;
  EXPECT_TRUE(photos.back().camera.empty());
}

// Some phones write a digital zoom into the 35 mm equivalent alone.
TEST(FirstCameras, ZoomsThatOnlyTheEquivalentTellsAreOtherCameras) {
  City city;
  std::vector<PhotoSubmission> photos = WithoutCamera(Around(14));
  for (const Stand& stand : Walk(30, 0.8, 3)) photos.push_back(WithoutCamera({stand}).front());
  for (size_t i = 0; i < photos.size(); ++i) {
    ExifCamera phone{"Maker", "Phone", "", 5.5};
    phone.focal_35mm = i < 14 ? 30 : 60;
    photos[i].photo.bytes = testing::WithExif(*photos[i].photo.bytes, testing::ExifOf(phone));
  }
  const auto cameras = city.engine().CalibrateFirst(photos);
  ASSERT_OK(cameras);
  ASSERT_FALSE(cameras->empty());
  EXPECT_EQ(cameras->front().name, "Maker Phone, 5.5 mm, 512x384") << cameras->front().why_not;
  EXPECT_EQ(cameras->front().photos, 14u);
  for (size_t i = 0; i < photos.size(); ++i)
    EXPECT_EQ(photos[i].camera, i < 14 ? cameras->front().name : "") << i;
}

// Adds the photos until so many are stored.
void AddSome(City* city, const std::vector<PhotoSubmission>& photos, size_t count) {
  std::stop_source stop;
  size_t added = 0;
  const auto report = [&](const AddOutcome& outcome) {
    if (++added == count) stop.request_stop();
  };
  const Status stopped = city->engine().AddPhotos(photos, report, stop.get_token());
  EXPECT_EQ(stopped.code(), StatusCode::kCancelled);
}

// The digest of a city of photos that name no camera, which was interrupted when so many were
// stored, and begun again.
std::string DigestOfInterrupted(size_t count) {
  City city;
  std::vector<PhotoSubmission> photos = WithoutCamera(Around(10));
  EXPECT_OK(city.engine().CalibrateFirst(photos));
  EXPECT_EQ(photos.front().camera, "photos of 512x384");
  if (count > 0) {
    AddSome(&city, photos, count);
    city.Open();
    photos = WithoutCamera(Around(10));
    const auto again = city.engine().CalibrateFirst(photos);
    EXPECT_OK(again);
    EXPECT_TRUE(again->empty()) << "nothing is calibrated anew";
  }
  city.Add(photos);
  const auto cameras = city.Ask().snapshot().ListCameras();
  EXPECT_EQ(cameras->size(), 2u) << "with the one that the test has added";
  for (const CameraRecord& camera : *cameras) EXPECT_EQ(camera.awaited, nullptr);
  EXPECT_GE(city.Counts().placed, 9u) << "of 10";
  return city.Digest();
}

TEST(FirstCameras, WhoIsInterruptedGoesOnAsItHadBegun) {
  const std::string undisturbed = DigestOfInterrupted(0);
  EXPECT_EQ(DigestOfInterrupted(2), undisturbed) << "before anything is placed";
  EXPECT_EQ(DigestOfInterrupted(6), undisturbed) << "afterwards";
}

std::vector<uint8_t> Resized(const std::vector<uint8_t>& jpeg, double scale) {
  cv::Mat small;
  cv::resize(cv::imdecode(jpeg, cv::IMREAD_COLOR), small, {}, scale, scale, cv::INTER_AREA);
  std::vector<uint8_t> bytes;
  EXPECT_TRUE(cv::imencode(".jpg", small, bytes, {cv::IMWRITE_JPEG_QUALITY, 95}));
  return bytes;
}

TEST(FirstCameras, TooFewPhotosOfEachCameraTellThemTogether) {
  constexpr double kScales[] = {1, 0.875, 0.75};
  std::vector<PhotoSubmission> photos = WithoutCamera(Around(9));
  for (size_t i = 0; i < photos.size(); ++i)
    photos[i].photo.bytes = Resized(*photos[i].photo.bytes, kScales[i % 3]);
  City city;
  const auto cameras = city.engine().CalibrateFirst(photos);
  ASSERT_OK(cameras);
  ASSERT_EQ(cameras->size(), 3u);
  for (size_t i = 0; i < 3; ++i) {
    const FirstCamera& first = cameras->at(i);
    EXPECT_FALSE(first.name.empty()) << first.why_not;
    EXPECT_EQ(first.photos, 3u);
    EXPECT_EQ(first.model.width_px, 512 * kScales[i]);
    EXPECT_NEAR(first.model.fx / (kScales[i] * StreetCameraModel().fx), 1, 0.02);
  }
  for (size_t i = 0; i < photos.size(); ++i)
    EXPECT_EQ(photos[i].camera, cameras->at(i % 3).name) << i;
  city.Add(photos);
  EXPECT_GE(city.Counts().placed, 8u) << "of 9";
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

TEST(SceneCalibration, WhatThePhotosTellIsTriedFirst) {
  const std::vector<PhotoSource> photos = Sources(Around(14));
  const double truth_share = StreetCameraModel().fx / StreetCameraModel().width_px;
  SceneCalibrationOptions options;
  options.told_focal_shares = {1.06 * truth_share};
  const Result<Calibration> told = CalibrateByScene(photos, 2, {}, options);
  ASSERT_OK(told);
  ExpectStreetCamera(told->model);
  EXPECT_NEAR(told->focal_search_px / StreetCameraModel().fx, 1.06, 1e-9);
  options.told_focal_shares = {9 * truth_share};  // nonsense
  const Result<Calibration> scanned = CalibrateByScene(photos, 2, {}, options);
  ASSERT_OK(scanned);
  ExpectStreetCamera(scanned->model);
}

// Of nothing: no two look alike.
std::vector<uint8_t> Blots(int seed) {
  cv::Mat blots(384, 512, CV_8UC1);
  cv::RNG random(static_cast<uint64_t>(seed) + 1);
  random.fill(blots, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(blots, blots, {}, 4);
  cv::normalize(blots, blots, 0, 255, cv::NORM_MINMAX);
  std::vector<uint8_t> bytes;
  EXPECT_TRUE(cv::imencode(".jpg", blots, bytes));
  return bytes;
}

TEST(FirstCameras, PhotosOfOnePlaceAreSoughtAmongMany) {
  std::vector<PhotoSubmission> photos;
  for (int i = 0; i < 40; ++i)
    photos.push_back({{"blots " + std::to_string(i), "", Blots(i)}, "", "anna"});
  for (PhotoSubmission& photo : WithoutCamera(Around(14))) photos.push_back(std::move(photo));
  City city;
  const auto cameras = city.engine().CalibrateFirst(photos);
  ASSERT_OK(cameras);
  ASSERT_EQ(cameras->size(), 1u);
  EXPECT_EQ(cameras->front().photos, 54u);
  ASSERT_FALSE(cameras->front().name.empty()) << cameras->front().why_not;
  ExpectStreetCamera(cameras->front().model);
}

// The middle of a photo that was taken smaller: as of a camera with a wider lens.
std::vector<uint8_t> Middle(const std::vector<uint8_t>& jpeg, double scale) {
  const cv::Mat small = cv::imdecode(Resized(jpeg, scale), cv::IMREAD_COLOR);
  const cv::Rect middle((small.cols - 400) / 2, (small.rows - 300) / 2, 400, 300);
  std::vector<uint8_t> bytes;
  EXPECT_TRUE(cv::imencode(".jpg", small(middle), bytes, {cv::IMWRITE_JPEG_QUALITY, 95}));
  return bytes;
}

TEST(FirstCameras, PhotosOfOneSizeMayBeOfManyCameras) {
  constexpr double kScales[] = {1, 0.8};
  std::vector<PhotoSubmission> photos = WithoutCamera(Around(14));
  for (size_t i = 0; i < photos.size(); ++i)
    photos[i].photo.bytes = Middle(*photos[i].photo.bytes, kScales[i % 2]);
  City city;
  const auto cameras = city.engine().CalibrateFirst(photos);
  ASSERT_OK(cameras);
  size_t known = 0;
  for (size_t i = 0; i < photos.size(); ++i) {
    if (photos[i].camera.empty()) continue;
    ++known;
    const auto stored = city.Ask().door().Camera(photos[i].camera);
    ASSERT_OK(stored);
    EXPECT_NEAR(stored->model.fx / (kScales[i % 2] * StreetCameraModel().fx), 1, 0.04) << i;
  }
  EXPECT_GE(known, 10u) << "of 14";
}

TEST(SceneCalibration, EachPhotoNeedsACamera) {
  const std::vector<PhotoSource> photos = Sources(Around(4));
  const std::vector<uint32_t> cameras = {0, 1, 0};
  EXPECT_EQ(CalibrateCamerasByScene(photos, cameras, 1).status().code(),
            StatusCode::kInvalidArgument);
}

TEST(FirstCameras, WhatCannotBeToldIsSaid) {
  City city;
  std::vector<PhotoSubmission> photos;
  for (const double along_m : {5.0, 25.0, 45.0, 65.0})
    photos.push_back(WithoutCamera({Stand{along_m, 90}}).front());
  const auto cameras = city.engine().CalibrateFirst(photos);
  ASSERT_OK(cameras);
  ASSERT_EQ(cameras->size(), 1u);
  EXPECT_TRUE(cameras->front().name.empty());
  EXPECT_NE(cameras->front().why_not.find("fit together"), std::string::npos);
  EXPECT_EQ(city.Ask().door().Cameras()->size(), 1u) << "the one that the test has added";
  EXPECT_TRUE(photos.front().camera.empty());
}

}  // namespace
}  // namespace veduta
