// SPDX-License-Identifier: Apache-2.0
// Goal: the door's functions for cameras do what their header says: requests out of bounds are
//   refused by name; photos and points become an answer whose texts can be read back; messages come
//   in the order of the work, and what is wrong with single photos is said also where nothing can
//   be calibrated; sheets, camera files and texts of cameras.
// Method: the functions alone, on a session of known truth written as a points.json, and on small
//   rendered photos of markers, one of them of nothing.
#include "engine/engine.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/engine/camera/markers/floor_view.h"
#include "tools/bench/calibration/synthetic_session.h"

namespace veduta {
namespace {

namespace fs = std::filesystem;

class CalibrationDoor : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) / ("veduta_door_" + std::to_string(getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  template <typename Bytes>
  std::string Write(const std::string& name, const Bytes& bytes) const {
    const std::string path = (folder_ / name).string();
    std::ofstream(path, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    return path;
  }

  fs::path folder_;
};

std::string PointsFileOf(const CalibrationInput& input) {
  nlohmann::json file = {{"width", input.views[0].size.width_px},
                         {"height", input.views[0].size.height_px},
                         {"views", nlohmann::json::array()}};
  for (const ViewObservations& view : input.views) {
    nlohmann::json points = nlohmann::json::array();
    for (const PointObservation& p : view.points)
      points.push_back({{"id", p.id}, {"x", p.px.x()}, {"y", p.px.y()}, {"sigma", p.sigma_px}});
    file["views"].push_back({{"name", view.name}, {"points", points}});
  }
  return file.dump();
}

TEST_F(CalibrationDoor, RequestsOutOfBoundsAreRefusedByName) {
  CalibrateRequest good;
  good.points_path = "points.json";
  EXPECT_TRUE(good.Check().ok());
  const auto expect_refused = [&](const char* words, auto change) {
    CalibrateRequest request = good;
    change(&request);
    EXPECT_EQ(request.Check().code(), StatusCode::kInvalidArgument) << words;
    EXPECT_NE(request.Check().message().find(words), std::string::npos)
        << request.Check().message();
    EXPECT_EQ(Calibrate(request).status().message(), request.Check().message());
  };
  expect_refused("none are given", [](CalibrateRequest* r) { r->points_path.clear(); });
  expect_refused("not both", [](CalibrateRequest* r) { r->photo_paths = {"a.jpg"}; });
  for (const uint32_t count : {0u, 179u}) {
    expect_refused("marker_count is ", [&](CalibrateRequest* r) { r->marker_count = count; });
  }
  for (const uint32_t count : {0u, 257u}) {
    expect_refused("thread_count is ", [&](CalibrateRequest* r) { r->thread_count = count; });
  }
}

TEST_F(CalibrationDoor, PointsBecomeAnAnswerThatCanBeReadBack) {
  const SyntheticSession session = MakeSession({.photo_count = 8, .seed = 21});
  CalibrateRequest request;
  request.points_path = Write("points.json", PointsFileOf(session.input));
  const Result<CalibrationAnswer> answer = Calibrate(request);
  ASSERT_TRUE(answer.ok()) << answer.status().message();
  EXPECT_TRUE(answer->is_good);
  EXPECT_EQ(answer->photos, 8u);
  EXPECT_EQ(answer->photos_used, 8u);
  EXPECT_EQ(answer->intrinsic_names[0], "fx");
  EXPECT_EQ(answer->intrinsic_names[7], "v0");
  EXPECT_EQ(answer->intrinsics[0], answer->model.fx);
  EXPECT_EQ(answer->intrinsics[5], answer->model.k2);
  EXPECT_LT(std::abs(answer->intrinsics[0] - session.truth.fx), 5 * answer->sigmas[0]);
  EXPECT_GT(answer->error_px_rms, answer->error_px_mean);
  EXPECT_GT(answer->distortion_sigma_px, 0);
  EXPECT_EQ(answer->from, "points.json");
  EXPECT_TRUE(answer->has_square_pixels);
  ASSERT_EQ(answer->calibrated_photos.size(), 8u);
  EXPECT_EQ(answer->calibrated_photos[2].name, session.input.views[2].name);
  EXPECT_GT(answer->calibrated_photos[2].points, 8u);
  EXPECT_GT(answer->calibrated_photos[2].error_px_rms, 0);
  EXPECT_TRUE(answer->calibrated_photos[2].why_left_out.empty());
  EXPECT_NE(answer->report_html.find("</html>"), std::string::npos);

  const Result<CameraFromFile> read = ReadCameraFile(Write("camera.json", answer->camera_file), {});
  ASSERT_TRUE(read.ok()) << read.status().message();
  EXPECT_EQ(read->model, answer->model);
  EXPECT_NE(read->source.find("calibrated from points.json: 8 photos"), std::string::npos);
}

TEST_F(CalibrationDoor, FilesThatCannotBeReadAreNamed) {
  CalibrateRequest request;
  request.points_path = (folder_ / "missing.json").string();
  EXPECT_EQ(Calibrate(request).status().code(), StatusCode::kIoError);
  EXPECT_NE(Calibrate(request).status().message().find("missing.json"), std::string::npos);
  request.points_path = Write("bad.json", std::string("{"));
  EXPECT_EQ(Calibrate(request).status().code(), StatusCode::kInvalidArgument);
  EXPECT_NE(Calibrate(request).status().message().find("bad.json: "), std::string::npos);
  EXPECT_NE(ReadCameraFile(request.points_path, {}).status().message().find("bad.json: "),
            std::string::npos);
  EXPECT_EQ(ReadCameraFile(folder_.string(), {}).status().code(), StatusCode::kIoError);
}

TEST_F(CalibrationDoor, NotesOnPhotosComeFirstAndAreNotLostWithAFailure) {
  floor::SessionOptions options;
  options.model = testing::FloorCameraModel(640, 480);
  options.photos = 8;
  options.floor.marker_count = 24;
  options.floor.flooring = floor::Flooring::kPlain;
  options.seed = options.floor.seed = options.photo.seed = 1;
  options.command = "test";
  const fs::path rendered = folder_ / "rendered";
  const Status status = floor::RenderSession(options, rendered.string(), nullptr);
  ASSERT_TRUE(status.ok()) << status.message();
  CalibrateRequest request;
  request.marker_count = 24;
  request.photo_paths = {
      Write("nothing.jpg", testing::EncodeGrayJpeg(cv::Mat(480, 640, CV_8UC1, cv::Scalar(128))))};
  const Status failure = Calibrate(request).status();
  EXPECT_EQ(failure.code(), StatusCode::kInvalidArgument);
  EXPECT_NE(failure.message().find("no photo shows enough markers"), std::string::npos);
  EXPECT_NE(failure.message().find("\n  nothing.jpg: no marker found"), std::string::npos)
      << failure.message();

  for (const auto& photo : fs::directory_iterator(rendered / "photos"))
    request.photo_paths.push_back(photo.path().string());
  std::sort(request.photo_paths.begin() + 1, request.photo_paths.end());
  const Result<CalibrationAnswer> answer = Calibrate(request);
  ASSERT_TRUE(answer.ok()) << answer.status().message();
  EXPECT_EQ(answer->photos, 8u) << "a photo of nothing is none of the calibration's";
  ASSERT_FALSE(answer->messages.empty());
  EXPECT_EQ(answer->messages[0].text.find("nothing.jpg: no marker found"), 0u);
  EXPECT_FALSE(answer->messages[0].is_warning);
  EXPECT_TRUE(answer->messages[0].is_of_photo);
  EXPECT_NE(answer->camera_file.find("nothing.jpg"), std::string::npos);
  EXPECT_NE(answer->report_html.find("nothing.jpg"), std::string::npos);
  EXPECT_NEAR(answer->model.fx / options.model.fx, 1, 0.01);
  request.thread_count = 3;
  EXPECT_EQ(Calibrate(request)->camera_file, answer->camera_file) << "threads do not matter";
}

TEST_F(CalibrationDoor, MarkerSheets) {
  const Result<MarkerSheets> sheets = MakeMarkerSheets("a4", 20);
  ASSERT_TRUE(sheets.ok()) << sheets.status().message();
  EXPECT_EQ(sheets->sheet_count, 4u);
  ASSERT_GT(sheets->pdf.size(), 4u);
  EXPECT_EQ(std::string(sheets->pdf.begin(), sheets->pdf.begin() + 4), "%PDF");
  EXPECT_EQ(MakeMarkerSheets("letter", 178)->sheet_count, 30u);
  EXPECT_NE(MakeMarkerSheets("a5", 20).status().message().find("'a5'"), std::string::npos);
  for (const uint32_t count : {0u, 179u})
    EXPECT_EQ(MakeMarkerSheets("a4", count).status().code(), StatusCode::kInvalidArgument);
}

TEST_F(CalibrationDoor, TextsOfCameras) {
  const Result<CameraModel> model = ParseCamera("640x480", "500.5,510,320,240,-0.25,0.05,321,239");
  ASSERT_TRUE(model.ok()) << model.status().message();
  EXPECT_EQ(*model, (CameraModel{640, 480, 500.5, 510, 320, 240, -0.25, 0.05, 321, 239}));
  EXPECT_EQ(CameraSizeText(*model), "640x480");
  EXPECT_EQ(CameraParamsText(*model), "500.5,510,320,240,-0.25,0.05,321,239");
  EXPECT_NE(ParseCamera("640", "1,2,3,4").status().message().find("'640'"), std::string::npos);
  EXPECT_NE(ParseCamera("640x480", "1,2,3").status().message().find("'1,2,3'"), std::string::npos);
}

}  // namespace
}  // namespace veduta
