// SPDX-License-Identifier: Apache-2.0
// Goal: a photo that was resized, encoded anew, brightened is known as the stored one, by another
//   camera as well; one from a step beside, or with something else in it, or of another time, is
//   not; where doubles are kept nothing is looked for.
// Method: photos of a synthetic street, and changed copies of them; real photos where they are
//   there: each against copies of itself and against its neighbours.
#include "engine/ingest/double_finder.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "engine/camera/orientation.h"
#include "engine/camera/photo_decoder.h"
#include "engine/photo/photo_file.h"
#include "tests/engine/camera/photo_writer.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

std::vector<uint8_t> Jpeg(const cv::Mat& picture, int quality) {
  std::vector<uint8_t> jpeg;
  EXPECT_TRUE(cv::imencode(".jpg", picture, jpeg, {cv::IMWRITE_JPEG_QUALITY, quality}));
  return jpeg;
}

struct Change {
  double scale = 1, gain = 1;
  int quality = 75;
  bool has_visitor = false;  // something that was not there before
};

cv::Mat Pixels(const std::vector<uint8_t>& jpeg) {
  return DecodePhoto(jpeg, DecodeLimits()).bgr;
}

cv::Mat Changed(const cv::Mat& whole, const Change& change) {
  cv::Mat picture = whole.clone();
  if (change.has_visitor)
    cv::rectangle(picture, {picture.cols / 3, picture.rows / 2, 24, 60}, {30, 20, 90}, -1);
  cv::resize(picture, picture, {}, change.scale, change.scale, cv::INTER_AREA);
  picture.convertTo(picture, -1, change.gain, 3);
  return picture;
}

CameraModel Scaled(CameraModel camera, double scale) {
  camera.width_px = static_cast<uint32_t>(std::lround(camera.width_px * scale));
  camera.height_px = static_cast<uint32_t>(std::lround(camera.height_px * scale));
  camera.fx *= scale;
  camera.fy *= scale;
  for (double* center : {&camera.cx, &camera.cy, &camera.u0, &camera.v0})
    *center = (*center + 0.5) * scale - 0.5;
  return camera;
}

// A city that refuses doubles, with a walk of five photos.
class DoubleFinder : public ::testing::Test {
 protected:
  explicit DoubleFinder(Doubles doubles = Doubles::kRefuse) {
    EngineOptions options;
    options.create = true;
    options.sync = false;
    options.thread_count = 2;
    options.doubles = doubles;
    auto opened = Engine::Open(folder_ / "db", options);
    EXPECT_OK(opened);
    engine_ = std::move(*opened);
    EXPECT_OK(engine_->AddCamera("street", StreetCameraModel(), ""));
    EXPECT_OK(engine_->AddCamera("half", Scaled(StreetCameraModel(), 0.5), ""));
    EXPECT_OK(engine_->AddCamera("double", Scaled(StreetCameraModel(), 2), ""));
    for (const Stand& stand : Walk(2, 0.8, 5))
      EXPECT_FALSE(Add(TakePhoto(stand).name, TakePhoto(stand).jpeg, "street").duplicate);
  }

  AddOutcome Add(const std::string& name, std::vector<uint8_t> bytes, const std::string& camera) {
    AddOutcome added;
    const PhotoSubmission photo[] = {{{name, name, std::move(bytes)}, camera, "anna"}};
    EXPECT_OK(engine_->AddPhotos(photo, [&](const AddOutcome& outcome) { added = outcome; }));
    return added;
  }
  AddOutcome AddChanged(const Change& change, const std::string& camera) {
    const cv::Mat picture = Changed(Pixels(TakePhoto(Walk(2, 0.8, 5)[2]).jpeg), change);
    return Add("changed.jpg", Jpeg(picture, change.quality), camera);
  }
  uint64_t CountImages() const { return engine_->Ask().Status()->images; }

  TemporaryFolder folder_;
  std::unique_ptr<Engine> engine_;
};

class KeptDouble : public DoubleFinder {
 protected:
  KeptDouble() : DoubleFinder(Doubles::kKeep) {}
};

TEST_F(DoubleFinder, ChangedCopiesAreAnsweredAsTheStoredPhoto) {
  const std::string digest = engine_->Ask().Digest().value();
  for (const auto& [change, camera] :
       {std::pair(Change{}, "street"), std::pair(Change{.quality = 30}, "street"),
        std::pair(Change{.gain = 0.85}, "street"), std::pair(Change{.scale = 0.5}, "half"),
        std::pair(Change{.scale = 2}, "double")}) {
    const AddOutcome outcome = AddChanged(change, camera);
    EXPECT_TRUE(outcome.duplicate) << outcome.detail;
    EXPECT_EQ(outcome.id, ImageId(3));
    EXPECT_NE(outcome.detail.find("the same picture as walk/"), std::string::npos)
        << outcome.detail;
  }
  EXPECT_EQ(CountImages(), 5u);
  EXPECT_EQ(engine_->Ask().Digest().value(), digest);
  EXPECT_TRUE(IsSound(CityQuestions(engine_->Ask()).snapshot()));
}

// A phone stores the sensor's pixels and says how they are turned; a messenger turns them.
TEST_F(DoubleFinder, ACopyThatWasTurnedUprightIsTheSamePhoto) {
  const cv::Mat lying = Pixels(TakePhoto({3.7, 75}).jpeg);
  const std::vector<uint8_t> stored =
      testing::WithExif(Jpeg(lying, 95), testing::ExifBlock(6, true));
  EXPECT_FALSE(Add("phone.jpg", stored, "street").duplicate);
  CameraModel standing = StreetCameraModel();
  std::swap(standing.width_px, standing.height_px);
  std::swap(standing.fx, standing.fy);
  const double cx = standing.cx, u0 = standing.u0;
  standing.cx = standing.width_px - 1.0 - standing.cy;
  standing.u0 = standing.width_px - 1.0 - standing.v0;
  standing.cy = cx;
  standing.v0 = u0;
  ASSERT_OK(engine_->AddCamera("standing", standing, ""));
  const AddOutcome copy = Add("message.jpg", Jpeg(Upright(lying, 6), 60), "standing");
  EXPECT_TRUE(copy.duplicate) << copy.detail;
  EXPECT_EQ(copy.id, ImageId(6));
  EXPECT_TRUE(IsSound(CityQuestions(engine_->Ask()).snapshot()));
}

TEST_F(DoubleFinder, ACopyWithoutACameraHasThatOfThePhoto) {
  for (const double scale : {1.0, 0.6}) {
    const AddOutcome copy = AddChanged({.scale = scale}, "");
    EXPECT_TRUE(copy.duplicate) << copy.detail << copy.failure.message();
    EXPECT_EQ(copy.id, ImageId(3));
  }
  EXPECT_EQ(CountImages(), 5u);
}

// The pair of a photo and its copy has no motion, and nothing else tells where the photo stands.
TEST_F(DoubleFinder, ACopyOfAPhotoWithoutAPoseIsTheSamePhoto) {
  const TakenPhoto& far = TakePhoto({30, 75});
  EXPECT_EQ(Add("far.jpg", far.jpeg, "street").verdict, Verdict::kPostponed);
  for (const char* camera : {"street", ""}) {
    const AddOutcome copy = Add("copy.jpg", Jpeg(Pixels(far.jpeg), 70), camera);
    EXPECT_TRUE(copy.duplicate) << camera << copy.detail << copy.failure.message();
    EXPECT_EQ(copy.id, ImageId(6));
  }
  const cv::Mat small = Changed(Pixels(far.jpeg), {.scale = 0.5});
  EXPECT_TRUE(Add("small.jpg", Jpeg(small, 80), "half").duplicate);
  EXPECT_EQ(CountImages(), 6u);
}

TEST_F(KeptDouble, ACopyWithoutACameraIsStoredWithThatOfThePhoto) {
  const AddOutcome copy = AddChanged({.scale = 0.5}, "");
  EXPECT_FALSE(copy.duplicate);
  EXPECT_EQ(copy.camera, "half") << copy.failure.message();
  const AddOutcome other = AddChanged({.scale = 0.75}, "");
  EXPECT_EQ(other.camera, "street at 384x288") << other.failure.message();
  EXPECT_TRUE(IsSound(CityQuestions(engine_->Ask()).snapshot()));
}

TEST_F(DoubleFinder, APhotoWithSomethingElseInItIsAnotherOne) {
  const AddOutcome outcome = AddChanged({.has_visitor = true}, "street");
  EXPECT_FALSE(outcome.duplicate) << outcome.detail;
  EXPECT_EQ(CountImages(), 6u);
}

TEST_F(DoubleFinder, APhotoFromAStepBesideIsAnotherOne) {
  const TakenPhoto& beside = TakePhoto({3.7, 75});
  EXPECT_FALSE(Add(beside.name, beside.jpeg, "street").duplicate);
}

TEST_F(KeptDouble, NothingIsLookedFor) {
  EXPECT_FALSE(AddChanged({}, "street").duplicate);
  EXPECT_EQ(CountImages(), 6u);
}

TEST(MatchAsOnePicture, AsksForOneRatioAndNearlyAllMatches) {
  const CameraModel whole = StreetCameraModel(), half = Scaled(whole, 0.5);
  Features first, second;
  std::vector<FeatureMatch> matches;
  for (uint32_t i = 0; i < 100; ++i) {
    const float x = static_cast<float>(5 * i), y = static_cast<float>(3 * i);
    first.keypoints.push_back({.x_px = x, .y_px = y});
    second.keypoints.push_back({.x_px = (x + 0.5f) / 2 - 0.5f, .y_px = (y + 0.5f) / 2 - 0.5f});
    matches.push_back({i, i});
  }
  const auto is_one = [&](const CameraModel& other) {
    return MatchAsOnePicture({whole, first}, {other, second}, matches);
  };
  EXPECT_TRUE(is_one(half));
  EXPECT_FALSE(MatchAsOnePicture({whole, first, 3}, {half, second}, matches)) << "half a turn";
  // A copy that was turned upright by whoever made it, of a photo that its camera has lying.
  Features turned;
  CameraModel standing = half;
  std::swap(standing.width_px, standing.height_px);
  for (const Keypoint& k : second.keypoints) {
    const float right = static_cast<float>(half.height_px) - 1 - k.y_px;
    turned.keypoints.push_back({.x_px = right, .y_px = k.x_px});
  }
  EXPECT_TRUE(MatchAsOnePicture({whole, first, 6}, {standing, turned}, matches));
  EXPECT_FALSE(MatchAsOnePicture({whole, first, 8}, {standing, turned}, matches));
  EXPECT_FALSE(MatchAsOnePicture({whole, first}, {standing, turned}, matches));
  CameraModel cropped = half;
  cropped.width_px -= 20;
  EXPECT_FALSE(is_one(cropped));
  for (size_t i = 0; i < 9; ++i) second.keypoints[i].x_px += 30;
  EXPECT_TRUE(is_one(half));
  for (size_t i = 9; i < 12; ++i) second.keypoints[i].x_px += 30;
  EXPECT_FALSE(is_one(half));
  matches.resize(30);
  EXPECT_FALSE(is_one(half));
}

// Photos of one place, from step to step, and what was made of each.
TEST(ShowTheSame, RealPhotosAreThemselvesAndNotTheirNeighbours) {
  for (const char* const scene : {"strecha/castle-P19", "streets/museum", "streets/lund"}) {
    const std::string folder = std::string(VEDUTA_TEST_DATA "/") + scene;
    if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is not there";
    std::vector<std::string> paths;
    for (const auto& file : std::filesystem::directory_iterator(folder)) {
      if (file.path().extension() == ".jpg") paths.push_back(file.path());
    }
    std::ranges::sort(paths);
    cv::Mat before;
    for (size_t i = 0; i < std::min<size_t>(paths.size(), 4); ++i) {
      const DecodedPhoto photo = DecodePhoto(*ReadPhotoFile(paths[i], 64 << 20), DecodeLimits());
      for (const Change& change : {Change{.scale = 0.5, .quality = 50}, Change{.gain = 0.9},
                                   Change{.scale = 1.3, .quality = 60}}) {
        const auto jpeg = Jpeg(Changed(photo.bgr, change), change.quality);
        EXPECT_TRUE(ShowTheSame(photo.gray, DecodePhoto(jpeg, DecodeLimits()).gray)) << paths[i];
      }
      EXPECT_FALSE(!before.empty() && ShowTheSame(photo.gray, before)) << paths[i];
      before = photo.gray;
    }
  }
}

}  // namespace
}  // namespace veduta
