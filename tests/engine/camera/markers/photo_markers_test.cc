// SPDX-License-Identifier: Apache-2.0
// Goal: every photo file is either in the calibration's input with the ids and places seen in
//   it, or has a note that says why not; threads do not matter.
// Method: a folder with good photos among a blank one, one of another size, a turned one, a
//   text and a missing one.
#include "engine/camera/markers/photo_markers.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "tests/engine/camera/markers/floor_view.h"
#include "tests/engine/camera/photo_writer.h"

namespace veduta {
namespace {

namespace fs = std::filesystem;
using testing::EncodeGrayJpeg;
using testing::TakeFloorView;

class PhotoMarkersTest : public ::testing::Test {
 protected:
  void SetUp() override {
    // Tests run side by side, each in a process of its own.
    folder_ = fs::path(::testing::TempDir()) / ("veduta_photo_markers_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "other");
    floor::FloorOptions options;
    options.marker_count = 12;
    options.is_scattered = false;
    view_ = TakeFloorView(options, 60, 15, {}, testing::FloorCameraModel(480, 360));
    jpeg_ = EncodeGrayJpeg(view_.gray);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string Write(const std::string& name, const std::vector<uint8_t>& bytes) {
    const std::string path = (folder_ / name).string();
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    return path;
  }

  fs::path folder_;
  testing::FloorView view_;
  std::vector<uint8_t> jpeg_;
};

TEST_F(PhotoMarkersTest, EachPhotoIsUsedOrHasAReason) {
  const cv::Mat blank(360, 480, CV_8UC1, cv::Scalar(128)),
      small = view_.gray(cv::Rect(0, 0, 400, 300));
  std::vector<uint8_t> cut(jpeg_.begin(), jpeg_.begin() + static_cast<ptrdiff_t>(jpeg_.size() / 2));
  const std::vector<std::string> paths = {
      Write("a.jpg", jpeg_),
      Write("blank.jpg", EncodeGrayJpeg(blank)),
      Write("small.jpg", EncodeGrayJpeg(small)),
      Write("turned.jpg", testing::WithExif(jpeg_, testing::ExifBlock(6, true))),
      Write("cut.jpg", cut),
      Write("text.jpg", {'h', 'e', 'l', 'l', 'o'}),
      (folder_ / "missing.jpg").string(),
      Write("other/a.jpg", jpeg_),
      Write("a.jpg", jpeg_)};
  ThreadPool pool(2), none(0);
  size_t done = 0;
  const PhotoMarkers result = DetectInPhotos(paths, {}, &pool, [&](size_t n) { done = n; }).value();
  EXPECT_EQ(done, 8u) << "the same path twice is one photo";
  ASSERT_EQ(result.notes.size(), 8u);
  std::map<std::string, PhotoUse> uses;
  for (const PhotoNote& note : result.notes) {
    uses[fs::relative(note.path, folder_).string()] = note.use;
    EXPECT_EQ(note.use == PhotoUse::kUsed, note.detail.empty()) << note.path;
  }
  const std::map<std::string, PhotoUse> expected = {{"a.jpg", PhotoUse::kUsed},
                                                    {"blank.jpg", PhotoUse::kTooFewMarkers},
                                                    {"small.jpg", PhotoUse::kOtherSize},
                                                    {"turned.jpg", PhotoUse::kUsed},
                                                    {"cut.jpg", PhotoUse::kUnreadable},
                                                    {"text.jpg", PhotoUse::kUnreadable},
                                                    {"missing.jpg", PhotoUse::kUnreadable},
                                                    {"other/a.jpg", PhotoUse::kUsed}};
  EXPECT_EQ(uses, expected);
  EXPECT_EQ(result.size, (ImageSize{480, 360}));
  ASSERT_EQ(result.input.views.size(), 3u);
  EXPECT_NE(result.input.views[0].name, result.input.views[2].name)
      << "two files of one name are told apart";
  for (const ViewObservations& view : result.input.views) {
    EXPECT_EQ(view.size, result.size);
    ASSERT_GE(view.points.size(), 8u);
    for (const PointObservation& point : view.points) {
      const auto truth =
          std::find_if(view_.truths.begin(), view_.truths.end(),
                       [&](const floor::MarkerTruth& t) { return t.id == point.id; });
      ASSERT_NE(truth, view_.truths.end());
      EXPECT_LT((truth->px - point.px).norm(), 0.2);
      EXPECT_GT(point.sigma_px, 0);
    }
  }
  const PhotoMarkers again = DetectInPhotos(paths, {}, &none).value();
  for (size_t i = 0; i < again.input.views.size(); ++i) {
    for (size_t k = 0; k < again.input.views[i].points.size(); ++k) {
      EXPECT_EQ(again.input.views[i].points[k].px, result.input.views[i].points[k].px);
    }
  }
}

TEST_F(PhotoMarkersTest, SaysWhatAPhotoCouldDoBetter) {
  floor::FloorOptions options;
  options.marker_count = 12;
  options.is_scattered = false;
  floor::FloorPhotoOptions soft, blurred;
  soft.blur_sigma_px = 1.2;
  blurred.blur_sigma_px = 2.6;
  const CameraModel model = testing::FloorCameraModel(480, 360);
  const cv::Mat softened = TakeFloorView(options, 60, 15, soft, model).gray;
  cv::Mat twice;  // the same sheets at two places
  cv::hconcat(view_.gray(cv::Rect(0, 0, 240, 360)), view_.gray(cv::Rect(0, 0, 240, 360)), twice);
  const std::vector<std::string> paths = {
      Write("sharp.jpg", jpeg_), Write("soft.jpg", EncodeGrayJpeg(softened)),
      Write("twice.jpg", EncodeGrayJpeg(twice)),
      Write("blurred.jpg", EncodeGrayJpeg(TakeFloorView(options, 60, 15, blurred, model).gray))};
  ThreadPool none(0);
  const PhotoMarkers result = DetectInPhotos(paths, {}, &none).value();
  ASSERT_EQ(result.input.views.size(), 3u);
  EXPECT_EQ(result.notes[0].advice, "");
  EXPECT_EQ(result.notes[1].advice, "") << "soft, but all its markers are found";
  EXPECT_EQ(result.notes[2].use, PhotoUse::kTooFewMarkers);
  EXPECT_NE(result.notes[2].detail.find("seen twice: "), std::string::npos)
      << result.notes[2].detail;
  EXPECT_NE(result.notes[3].advice.find("out of focus"), std::string::npos)
      << result.notes[3].blur_share;
  EXPECT_NEAR(result.notes[3].blur_px, 2.6, 0.3);
  EXPECT_NEAR(result.notes[3].blur_share, 2.6 / 60, 0.01);
}

TEST_F(PhotoMarkersTest, RefusesNothingAndBadOptions) {
  ThreadPool pool(0);
  EXPECT_EQ(DetectInPhotos({}, {}, &pool).status().code(), StatusCode::kInvalidArgument);
  PhotoMarkersOptions options;
  options.marker_count_min = 0;
  EXPECT_EQ(DetectInPhotos({"x"}, options, &pool).status().code(), StatusCode::kInvalidArgument);
  const PhotoMarkers folder = DetectInPhotos({folder_.string()}, {}, &pool).value();
  EXPECT_EQ(folder.notes[0].use, PhotoUse::kUnreadable);
  EXPECT_TRUE(folder.input.views.empty());
}

}  // namespace
}  // namespace veduta
