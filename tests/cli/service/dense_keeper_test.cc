// SPDX-License-Identifier: Apache-2.0
// Goal: the dense city follows the sparse one by itself, can be paused, and does nothing where it
//   is not wanted or has nothing to do.
// Method: a small street whose photos come in two parts; the pass in C++ at a low resolution.
#include "cli/service/dense_keeper.h"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <stop_token>
#include <thread>

#include "tests/engine/street_fixture.h"
#include "tests/option_bounds.h"

namespace veduta {
namespace {

DenseKeeping Coarse() {
  DenseKeeping keeping;
  keeping.is_wanted = true;
  keeping.request.device = "cpp";
  keeping.request.options.depth_side_px = 64;
  keeping.request.options.voxel_size = 0.2;
  keeping.pause_s = 1;
  keeping.patience_s = 2;
  return keeping;
}

void WaitForPasses(const DenseKeeper& keeper, uint64_t count) {
  while (keeper.ToJson()["passes"].get<uint64_t>() < count) {
    ASSERT_EQ(keeper.ToJson()["why_not"], nullptr);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}

TEST(DenseKeeper, FollowsTheSparseCity) {
  City city;
  DenseKeeper keeper(&city.engine(), Coarse(), {});
  const std::vector<Stand> stands = Walk(6, 0.9, 5);
  city.Add({stands[0], stands[1], stands[2], stands[3]});
  WaitForPasses(keeper, 1);
  const uint64_t first = city.Counts().reconstructions.at(0).depth_maps;
  EXPECT_GE(first, 3u);
  city.Add({stands[4]});
  WaitForPasses(keeper, 2);
  EXPECT_GT(city.Counts().reconstructions.at(0).depth_maps, first);
  EXPECT_EQ(keeper.ToJson()["why_not"], nullptr);
}

TEST(DenseKeeper, RestsWhileItIsPaused) {
  City city;
  DenseKeeper keeper(&city.engine(), Coarse(), {});
  ASSERT_OK(keeper.Pause(true));
  city.Add(Walk(6, 0.9, 4));
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  EXPECT_EQ(keeper.ToJson()["state"], "paused");
  EXPECT_EQ(keeper.ToJson()["passes"], 0);
  ASSERT_OK(keeper.Pause(false));
  WaitForPasses(keeper, 1);
}

TEST(DenseKeeper, RestsForWhoAsksItTo) {
  City city;
  DenseKeeper keeper(&city.engine(), Coarse(), {});
  {
    const DenseKeeper::Rest rest(&keeper);
    city.Add(Walk(6, 0.9, 4));
    std::this_thread::sleep_for(std::chrono::milliseconds(1500));
    EXPECT_EQ(keeper.ToJson()["passes"], 0);
    EXPECT_EQ(keeper.ToJson()["state"], "waiting");
  }
  WaitForPasses(keeper, 1);
}

TEST(DenseKeeper, ARestEndsThePassOfSomebodyElse) {
  City city;
  DenseKeeper keeper(&city.engine(), {}, {});
  std::stop_source stop;
  std::atomic<bool> is_over = false;
  auto pass = std::make_unique<DenseKeeper::OthersPass>(&keeper, stop.get_token());
  EXPECT_EQ(keeper.ToJson()["state"], "working");
  pass->Tell("volume", 2, 5);
  EXPECT_EQ(keeper.ToJson()["stage"], "volume");
  std::thread works([&, token = pass->token()] {
    while (!token.stop_requested()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    is_over = true;
    pass.reset();
  });
  {
    const DenseKeeper::Rest rest(&keeper);
    EXPECT_TRUE(is_over);
    EXPECT_EQ(keeper.ToJson()["state"], "off");
  }
  works.join();
  const DenseKeeper::OthersPass next(&keeper, stop.get_token());
  EXPECT_FALSE(next.token().stop_requested());
  stop.request_stop();
  EXPECT_TRUE(next.token().stop_requested());
}

TEST(DenseKeeper, ThePassOfSomebodyElseWaitsForItsTurn) {
  City city;
  DenseKeeper keeper(&city.engine(), {}, {});
  std::stop_source stop;
  auto first = std::make_unique<DenseKeeper::OthersPass>(&keeper, stop.get_token());
  std::atomic<int> begun = 0;
  std::thread second([&] {
    const DenseKeeper::OthersPass pass(&keeper, stop.get_token());
    EXPECT_FALSE(pass.token().stop_requested());
    ++begun;
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(begun, 0);
  EXPECT_FALSE(first->token().stop_requested());
  first.reset();
  second.join();
  EXPECT_EQ(begun, 1);

  auto rest = std::make_unique<DenseKeeper::Rest>(&keeper);
  std::thread third([&] {
    const DenseKeeper::OthersPass pass(&keeper, stop.get_token());
    ++begun;
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(begun, 1);
  rest.reset();
  third.join();
  EXPECT_EQ(begun, 2);

  rest = std::make_unique<DenseKeeper::Rest>(&keeper);
  std::thread gives_up([&] {
    const DenseKeeper::OthersPass pass(&keeper, stop.get_token());
    EXPECT_TRUE(pass.token().stop_requested());
  });
  stop.request_stop();
  gives_up.join();
  EXPECT_EQ(keeper.ToJson()["state"], "off");
}

TEST(DenseKeeper, TellsWhyItFails) {
  City city;
  DenseKeeping keeping = Coarse();
  keeping.request.device = "a device that is not there";
  std::atomic<int> failures = 0;
  DenseKeeper keeper(&city.engine(), keeping, [&](const Status&) { ++failures; });
  city.Add(Walk(6, 0.9, 4));
  while (failures == 0) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_NE(keeper.ToJson()["why_not"], nullptr);
  EXPECT_EQ(keeper.ToJson()["passes"], 0);
}

TEST(DenseKeeper, IsOffWhereItIsNotWanted) {
  City city;
  DenseKeeper keeper(&city.engine(), {}, {});
  EXPECT_EQ(keeper.ToJson()["state"], "off");
  EXPECT_EQ(keeper.Pause(true).code(), StatusCode::kInvalidArgument);
}

TEST(DenseKeeping, HasBounds) {
  ExpectBounds(&DenseKeeping::pause_s, "pause_s", {0u, 86'401u}, {1u, 60u});
  ExpectBounds(&DenseKeeping::patience_s, "patience_s", {4u, 86'401u}, {5u, 86'400u});
}

}  // namespace
}  // namespace veduta
