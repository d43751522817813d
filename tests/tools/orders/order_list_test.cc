// SPDX-License-Identifier: Apache-2.0
// Goal: the order of a seed is the one that anybody gets from a shell, and truth is read as it was
//   written.
// Method: the shell's own line beside ours; files with damage.
#include "tools/bench/orders/order_list.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <fstream>

#include "tools/bench/orders/scratch_folder.h"
#include "tools/bench/orders/truth_folder.h"

namespace veduta::orders {
namespace {

void Write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path);
  file << text;
}

std::vector<std::string> ShellLines(const std::string& command) {
  std::vector<std::string> lines;
  FILE* const pipe = popen(("bash -c '" + command + "'").c_str(), "r");
  std::array<char, 4096> line;
  while (pipe != nullptr && std::fgets(line.data(), line.size(), pipe) != nullptr) {
    lines.emplace_back(line.data());
    lines.back().pop_back();
  }
  if (pipe != nullptr) pclose(pipe);
  return lines;
}

std::vector<std::string> Paths(const PhotoOrder& order) {
  std::vector<std::string> paths;
  for (const OrderedPhoto& photo : order.photos) paths.push_back(photo.path);
  return paths;
}

TEST(OrderList, ASeedIsTheShellsOrder) {
  auto scratch = ScratchFolder::Make();
  ASSERT_TRUE(scratch.ok());
  const std::string folder = scratch->path().string();
  for (int i = 0; i < 137; ++i)
    Write(scratch->path() / ("photo" + std::to_string(1000 + i) + (i % 2 ? ".jpg" : ".PNG")), "");
  Write(scratch->path() / "camera.txt", "");
  Write(scratch->path() / ".hidden.jpg", "");
  const auto photos = ListFolder(folder);
  ASSERT_TRUE(photos.ok()) << photos.status().message();
  ASSERT_EQ(photos->size(), 137u);
  const std::string list = "ls " + folder + "/*.[jJpP][pPnN]*[gG]";
  EXPECT_EQ(Paths(ShuffledOrder(*photos, 0).value()), ShellLines(list));
  std::vector<std::string> last;
  for (const uint64_t seed : {1, 6, 123456}) {
    const auto order = ShuffledOrder(*photos, seed);
    ASSERT_TRUE(order.ok()) << order.status().message();
    EXPECT_EQ(order->label, "seed " + std::to_string(seed));
    EXPECT_EQ(Paths(*order),
              ShellLines(list + " | shuf --random-source=<(yes " + std::to_string(seed) + ")"));
    EXPECT_NE(Paths(*order), last);
    last = Paths(*order);
  }
}

TEST(OrderList, AListKeepsItsOrder) {
  auto scratch = ScratchFolder::Make();
  ASSERT_TRUE(scratch.ok());
  const std::string list = (scratch->path() / "list").string();
  Write(list, "set/b.jpg\nset/a.jpg\nset/c.jpg\n");
  const auto order = ListedOrder(list);
  ASSERT_TRUE(order.ok()) << order.status().message();
  EXPECT_EQ(order->label, list);
  EXPECT_EQ(Paths(*order), (std::vector<std::string>{"set/b.jpg", "set/a.jpg", "set/c.jpg"}));
  EXPECT_EQ(order->photos[0].name, "b.jpg");
  EXPECT_FALSE(ListedOrder(list + ".none").ok());
  EXPECT_EQ(ListFolder(scratch->path().string()).status().code(), StatusCode::kNotFound);
  EXPECT_EQ(ListFolder(list + ".none").status().code(), StatusCode::kIoError);
}

TEST(TruthFolder, ReadsCamerasAndRefusesDamage) {
  auto scratch = ScratchFolder::Make();
  ASSERT_TRUE(scratch.ok());
  const std::string folder = scratch->path().string();
  const std::string head = "500 0 320\n0 500 240\n0 0 1\n0 0 0\n";
  // Camera to world: the camera's z looks along the world's x.
  const std::string rotation = "0 0 1\n-1 0 0\n0 -1 0\n";
  Write(scratch->path() / "a.jpg.camera", head + rotation + "1 2 3\n640 480\n");
  Write(scratch->path() / "b.jpg.camera", head + rotation + "1 2 7\n640 480\n");
  EXPECT_EQ(ReadTruth(folder).status().code(), StatusCode::kNotFound);  // two
  Write(scratch->path() / "c.jpg.camera", head + rotation + "4 2 3\n640 480\n");
  Write(scratch->path() / "notes", "");
  const auto truth = ReadTruth(folder);
  ASSERT_TRUE(truth.ok()) << truth.status().message();
  ASSERT_EQ(truth->size(), 3u);
  const Rigid3& camera = truth->at("a.jpg");
  EXPECT_LT((camera.Center() - Eigen::Vector3d(1, 2, 3)).norm(), 1e-12);
  EXPECT_LT((camera * Eigen::Vector3d(6, 2, 3) - Eigen::Vector3d(0, 0, 5)).norm(), 1e-12);
  EXPECT_DOUBLE_EQ(ExtentOf(*truth), 5);
  Write(scratch->path() / "d.jpg.camera", head + "0 0 1\n1 0 0\n0 -1 0\n1 2 3\n640 480\n");
  EXPECT_EQ(ReadTruth(folder).status().code(), StatusCode::kCorruption);  // a mirror
  Write(scratch->path() / "d.jpg.camera", head + rotation + "1 2\n");
  EXPECT_EQ(ReadTruth(folder).status().code(), StatusCode::kCorruption);  // cut short
  EXPECT_EQ(ReadTruth(folder + "/none").status().code(), StatusCode::kIoError);
}

}  // namespace
}  // namespace veduta::orders
