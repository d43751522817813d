// SPDX-License-Identifier: Apache-2.0
// Goal: a rendered data set is complete and the same bytes each time, its truth reads back, and
//   what cannot be rendered is refused before anything is written.
// Method: small data sets; compare files byte by byte between thread counts; damage and
//   misspell.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <string>

#include "street_view.h"
#include "tools/render/street/truth_file.h"

namespace veduta::street {
namespace {

namespace fs = std::filesystem;

std::string Bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

std::map<std::string, std::string> AllFiles(const Folder& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder.str())) {
    if (entry.is_regular_file())
      files[fs::relative(entry.path(), folder.str()).string()] = Bytes(entry.path().string());
  }
  return files;
}

DataSetOptions SmallSet() {
  DataSetOptions options;
  options.rig.model = MakeDistortedModel();
  options.rig.photos = 6;
  options.scene = SceneForTrajectory(Trajectory::kStreet, 6, 20);
  options.render.noise_sigma = 2;
  options.render.blur_sigma_px = 0.6;
  options.render.exposure_stops = 0.5;
  options.render.depth = true;
  options.mesh = true;
  return options;
}

TEST(StreetFiles, SameBytesOnAnyNumberOfThreads) {
  Folder one("one"), two("two"), other("other");
  DataSetOptions options = SmallSet();
  ASSERT_TRUE(RenderStreet(options, one.str(), nullptr).ok());
  options.threads = 2;
  size_t done = 0;
  ASSERT_TRUE(RenderStreet(options, two.str(), [&](size_t n) { done = n; }).ok());
  EXPECT_EQ(done, 6u);
  const auto a = AllFiles(one), b = AllFiles(two);
  EXPECT_EQ(a.size(), 6u * 3 + 3);
  EXPECT_TRUE(a == b);
  options.scene.seed = 2;
  ASSERT_TRUE(RenderStreet(options, other.str(), nullptr).ok());
  const auto c = AllFiles(other);
  EXPECT_NE(a.at("photos/photo0001.jpg"), c.at("photos/photo0001.jpg"));
  EXPECT_EQ(a.at("truth/photo0001.jpg.camera"), c.at("truth/photo0001.jpg.camera"));
}

TEST(StreetFiles, TruthFilesReadBack) {
  Folder folder("truth");
  DataSetOptions options = SmallSet();
  ASSERT_TRUE(RenderStreet(options, folder.str(), nullptr).ok());
  const auto cameras = MakeCameras(options.scene, options.rig).value();
  for (const StreetCamera& camera : cameras) {
    const StreetCamera read = ReadCameraFile(folder / ("truth/" + camera.name + ".camera")).value();
    EXPECT_LT((read.cam_from_world.Center() - camera.cam_from_world.Center()).norm(), 1e-9);
    EXPECT_LT(read.cam_from_world.rotation.angularDistance(camera.cam_from_world.rotation), 1e-7);
    EXPECT_EQ(read.model.fx, camera.model.fx);
    EXPECT_EQ(read.model.cy, camera.model.cy);
    EXPECT_EQ(read.model.width_px, camera.model.width_px);
  }
  EXPECT_TRUE(ReadIntrinsicsFile(folder / "camera.txt").value() == options.rig.model);
  EXPECT_EQ(CameraParams(options.rig.model), "280,276,159.5,119.5,-0.17,0.04,164.5,115.5");
  const auto scene = Build(options.scene);
  RenderOptions render = options.render;
  render.seed = MixSeed(options.render.seed, 2);
  const StreetPhoto photo = RenderPhoto(*scene, cameras[2], render).value();
  EXPECT_TRUE(ReadDepthFile(folder / "truth/photo0003.jpg.depth").value().depth == photo.depth);
  const std::vector<uint8_t> jpeg = EncodeJpeg(photo, options.jpeg_quality).value();
  EXPECT_EQ(Bytes(folder / "photos/photo0003.jpg"), std::string(jpeg.begin(), jpeg.end()));

  std::ofstream(folder / "broken") << "1 2 3";
  EXPECT_EQ(ReadCameraFile(folder / "broken").status().code(), StatusCode::kCorruption);
  EXPECT_EQ(ReadIntrinsicsFile(folder / "broken").status().code(), StatusCode::kCorruption);
  EXPECT_EQ(ReadDepthFile(folder / "broken").status().code(), StatusCode::kCorruption);
  EXPECT_EQ(ReadDepthFile(folder / "absent").status().code(), StatusCode::kIoError);
  fs::resize_file(folder / "truth/photo0001.jpg.depth", 1000);
  EXPECT_EQ(ReadDepthFile(folder / "truth/photo0001.jpg.depth").status().code(),
            StatusCode::kCorruption);
}

TEST(StreetFiles, ShuffleOnlyRenames) {
  const SceneOptions scene = SceneForTrajectory(Trajectory::kStreet, 30, 0);
  RigOptions rig;
  rig.model = MakeModel(320, 240, 280);
  rig.photos = 30;
  const auto ordered = MakeCameras(scene, rig).value();
  rig.shuffle = true;
  const auto shuffled = MakeCameras(scene, rig).value();
  const auto sorted_x = [](const std::vector<StreetCamera>& cameras) {
    std::vector<double> x;
    for (const auto& camera : cameras) x.push_back(camera.cam_from_world.Center().x());
    std::sort(x.begin(), x.end());
    return x;
  };
  EXPECT_EQ(sorted_x(ordered), sorted_x(shuffled));
  int unmoved = 0;
  for (size_t i = 0; i < 30; ++i) {
    EXPECT_EQ(ordered[i].name, shuffled[i].name);
    unmoved += ordered[i].cam_from_world.translation == shuffled[i].cam_from_world.translation;
  }
  EXPECT_LT(unmoved, 10);
}

TEST(StreetFiles, RefusesWhatItCannotDo) {
  Folder folder("refused");
  DataSetOptions options = SmallSet();
  const auto code = [&](const std::function<void(DataSetOptions&)>& spoil) {
    DataSetOptions bad = options;
    spoil(bad);
    return RenderStreet(bad, folder.str(), nullptr).code();
  };
  EXPECT_EQ(code([](auto& o) { o.rig.photos = 0; }), StatusCode::kInvalidArgument);
  EXPECT_EQ(code([](auto& o) { o.rig.model.fx = std::nan(""); }), StatusCode::kInvalidArgument);
  EXPECT_EQ(code([](auto& o) { o.rig.model.width_px = 9000; }), StatusCode::kInvalidArgument);
  EXPECT_EQ(code([](auto& o) { o.rig.model.k1 = -1.9; }), StatusCode::kInvalidArgument);
  EXPECT_EQ(code([](auto& o) { o.render.noise_sigma = -1; }), StatusCode::kInvalidArgument);
  EXPECT_EQ(code([](auto& o) { o.render.supersample = 9; }), StatusCode::kInvalidArgument);
  EXPECT_EQ(code([](auto& o) { o.scene.length_m = std::nan(""); }), StatusCode::kInvalidArgument);
  EXPECT_EQ(code([](auto& o) { o.jpeg_quality = 0; }), StatusCode::kInvalidArgument);
  EXPECT_EQ(code([](auto& o) { o.threads = 0; }), StatusCode::kInvalidArgument);
  EXPECT_EQ(code([](auto& o) { o.rig.trajectory = Trajectory::kLoop; }),
            StatusCode::kInvalidArgument);
  EXPECT_FALSE(fs::exists(folder.str()));  // nothing was begun
  fs::create_directories(folder.str());
  std::ofstream(folder / "mine") << "keep";
  EXPECT_EQ(code([](auto&) {}), StatusCode::kAlreadyExists);
  EXPECT_EQ(Bytes(folder / "mine"), "keep");
  EXPECT_FALSE(fs::exists(folder / "photos"));
}

}  // namespace
}  // namespace veduta::street
