// SPDX-License-Identifier: Apache-2.0
// Goal: orders run beside each other without touching each other: what one of them does to its
//   process is told, and the others end as ever.
// Method: runners that answer, abort and exit; then the built program on a few photos of a street,
//   once with its truth and once with a truth that is damaged.
#include "tools/bench/orders/side_by_side.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "tools/bench/orders/scratch_folder.h"
#include "tools/render/street/data_set.h"
#include "tools/render/street/truth_file.h"

namespace veduta::orders {
namespace {

namespace fs = std::filesystem;

// Photo "i" of the order says what its runner does.
OrderRun Act(const PhotoOrder& order, const std::string& folder) {
  const std::string& what = order.photos.front().name;
  if (what == "abort") {
    std::fprintf(stderr, "a line before\nimage 814 is not loaded\n");
    std::abort();
  }
  if (what == "exit") std::_Exit(3);
  std::ofstream(folder + "/database") << what;
  OrderRun run;
  run.label = order.label;
  run.photos = 1;
  run.placed = 1, run.postponed = 2, run.rejected = 3, run.failed = 4;
  run.seconds = 0.1;
  run.failure = what == "fail" ? "a disk is full" : "";
  PlacedPhoto placed;
  placed.name = "a name with spaces.jpg";
  placed.reconstruction = 6;
  placed.cam_from_world.rotation = Eigen::Quaterniond(0.1, 0.2, 0.3, 0.4).normalized();
  placed.cam_from_world.translation = Eigen::Vector3d(1.0 / 3, -2e-17, 3e17);
  run.poses = {placed, placed};
  return run;
}

std::vector<PhotoOrder> Orders(const std::vector<std::string>& names) {
  std::vector<PhotoOrder> orders;
  for (const std::string& name : names)
    orders.push_back({"order " + name, {{name, "path of " + name}}});
  return orders;
}

TEST(SideBySide, EachOrderEndsInItsOwnWay) {
  const auto orders = Orders({"well", "abort", "exit", "fail", "well again"});
  for (const uint32_t jobs : {1u, 3u, 9u}) {
    std::map<size_t, OrderRun> runs;
    const Status status = RunSideBySide(
        orders, {jobs, false}, Act,
        [&](size_t i, const OrderRun& run) { EXPECT_TRUE(runs.emplace(i, run).second); });
    ASSERT_TRUE(status.ok()) << status.message();
    ASSERT_EQ(runs.size(), 5u);
    EXPECT_EQ(runs[0].failure, "");
    EXPECT_EQ(runs[1].failure, "ended by signal 6: image 814 is not loaded");
    EXPECT_EQ(runs[1].label, "order abort");
    EXPECT_EQ(runs[1].photos, 1u);
    EXPECT_EQ(runs[2].failure, "ended with exit code 3");
    EXPECT_EQ(runs[3].failure, "a disk is full");
    EXPECT_EQ(runs[4].label, "order well again");
    const OrderRun expected = Act(orders[0], fs::temp_directory_path().string());
    ASSERT_EQ(runs[0].poses.size(), 2u);
    const PlacedPhoto &placed = runs[0].poses[1], &sent = expected.poses[1];
    EXPECT_EQ(placed.name, sent.name);
    EXPECT_EQ(placed.reconstruction, sent.reconstruction);
    EXPECT_EQ(placed.cam_from_world.rotation.coeffs(), sent.cam_from_world.rotation.coeffs());
    EXPECT_EQ(placed.cam_from_world.translation, sent.cam_from_world.translation);
    EXPECT_EQ(runs[0].placed, 1u);
    EXPECT_EQ(runs[0].postponed, 2u);
    EXPECT_EQ(runs[0].rejected, 3u);
    EXPECT_EQ(runs[0].failed, 4u);
    EXPECT_EQ(runs[0].kept, "");
  }
}

TEST(SideBySide, FoldersAreKeptOnlyOnDemand) {
  const auto orders = Orders({"well", "abort"});
  std::vector<std::string> kept;
  ASSERT_TRUE(RunSideBySide(orders, {2, true}, Act, [&](size_t, const OrderRun& run) {
                kept.push_back(run.kept);
              }).ok());
  ASSERT_EQ(kept.size(), 2u);
  for (const std::string& folder : kept) {
    EXPECT_TRUE(fs::is_directory(folder));
    fs::remove_all(folder);
  }
}

TEST(SideBySide, ATextThatIsCutIsRefused) {
  const std::string text = RunText(Act(Orders({"well"})[0], fs::temp_directory_path().string()));
  EXPECT_TRUE(ParseRun(text).ok());
  EXPECT_FALSE(ParseRun(text.substr(0, text.size() / 2)).ok());
  EXPECT_FALSE(ParseRun("").ok());
}

// The program's exit code and the lines that it printed.
std::pair<int, std::vector<std::string>> RunProgram(const std::string& arguments) {
  FILE* const pipe = popen((VEDUTA_BENCH_ORDERS " " + arguments).c_str(), "r");
  std::vector<std::string> lines;
  std::array<char, 8192> line;
  while (pipe != nullptr && std::fgets(line.data(), line.size(), pipe) != nullptr)
    lines.emplace_back(line.data());
  const int state = pipe == nullptr ? -1 : pclose(pipe);
  return {WIFEXITED(state) ? WEXITSTATUS(state) : -1, lines};
}

// The first eight stations of a loop of 150.
class OrdersProgram : public testing::Test {
 protected:
  OrdersProgram() {
    CameraModel& model = options_.rig.model;
    model.width_px = 640, model.height_px = 480;
    model.fx = model.fy = 563.2;
    model.cx = model.u0 = 319.5, model.cy = model.v0 = 239.5;
    options_.rig.trajectory = street::Trajectory::kLoop;
    options_.rig.photos = 150;
    options_.scene = street::SceneForTrajectory(street::Trajectory::kLoop, 150, 0);
  }

  void SetUp() override {
    auto scratch = ScratchFolder::Make();
    ASSERT_TRUE(scratch.ok());
    scratch_.emplace(*std::move(scratch));
    folder_ = scratch_->path() / "street";
    const auto cameras = street::MakeCameras(options_.scene, options_.rig);
    ASSERT_TRUE(cameras.ok());
    cameras_ = *cameras;
    const auto scene = street::BuildScene(options_.scene);
    ASSERT_TRUE(scene.ok());
    for (const char* part : {"photos", "truth"}) fs::create_directories(folder_ + "/" + part);
    for (size_t i = 0; i < 8; ++i) {
      const street::StreetCamera& camera = cameras_[i];
      const auto photo = street::RenderPhoto(**scene, camera, {});
      ASSERT_TRUE(photo.ok());
      const auto jpeg = street::EncodeJpeg(*photo, 92).value();
      std::ofstream(folder_ + "/photos/" + camera.name, std::ios::binary)
          .write(reinterpret_cast<const char*>(jpeg.data()),
                 static_cast<std::streamsize>(jpeg.size()));
      ASSERT_TRUE(street::WriteCameraFile(camera, TruthOf(camera)).ok());
    }
  }

  std::string TruthOf(const street::StreetCamera& camera) const {
    return folder_ + "/truth/" + camera.name + ".camera";
  }
  std::string Set() const { return folder_ + "/photos " + folder_ + "/truth"; }

  street::DataSetOptions options_;
  std::optional<ScratchFolder> scratch_;
  std::string folder_;
  std::vector<street::StreetCamera> cameras_;
};

TEST_F(OrdersProgram, WithoutACameraThePhotosTellIt) {
  const auto [code, lines] = RunProgram(Set() + " --first 0 --last 0 --json");
  EXPECT_EQ(code, 0);
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_GE(nlohmann::json::parse(lines[0])["told"], 6);
  EXPECT_EQ(RunProgram(Set() + " --params 1,1,1,1 2>&1").first, 2);
}

TEST_F(OrdersProgram, JudgesAStreet) {
  const std::string set =
      Set() + " --size 640x480 --params " + street::CameraParams(options_.rig.model);
  const auto [code, lines] = RunProgram(set + " --first 0 --last 1 --jobs 2 --json");
  EXPECT_EQ(code, 0);
  ASSERT_EQ(lines.size(), 3u);
  const auto all = nlohmann::json::parse(lines[2]);
  EXPECT_EQ(all["orders"], 2);
  EXPECT_EQ(all["wrong"], 0);
  EXPECT_DOUBLE_EQ(all["error_m_max"].get<double>(), 0.5);
  for (int i = 0; i < 2; ++i) {
    const auto one = nlohmann::json::parse(lines[static_cast<size_t>(i)]);
    EXPECT_EQ(one["photos"], 8);
    EXPECT_GE(one["placed"], 7);
    ASSERT_EQ(one["reconstructions"].size(), 1u);
    EXPECT_LT(one["all"]["center_max_m"], 0.2);
  }

  // A truth that says another place for one photo makes every order wrong.
  auto damaged = cameras_[3];
  damaged.cam_from_world.translation += Eigen::Vector3d(0, 3, 0);
  ASSERT_TRUE(street::WriteCameraFile(damaged, TruthOf(damaged)).ok());
  const auto [wrong_code, wrong_lines] = RunProgram(set + " --last 1");
  EXPECT_EQ(wrong_code, 1);
  ASSERT_GT(wrong_lines.size(), 2u);
  EXPECT_NE(wrong_lines[0].find("seed 1: WRONG"), std::string::npos) << wrong_lines[0];
  EXPECT_NE(wrong_lines[1].find("worst " + damaged.name), std::string::npos) << wrong_lines[1];
  EXPECT_EQ(RunProgram(set + " --first 3 --last 2 2>&1").first, 2);
  EXPECT_EQ(RunProgram(set + " --error-deg 0 2>&1").first, 2);
}

}  // namespace
}  // namespace veduta::orders
