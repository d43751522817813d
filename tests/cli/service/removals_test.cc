// SPDX-License-Identifier: Apache-2.0
// Goal: what cannot be removed is refused while a dense pass runs on, what can waits for its end,
//   and a removal that is stopped says so.
// Method: a small street whose dense pass is held at its end.
#include "cli/service/removals.h"

#include <gtest/gtest.h>

#include <future>

#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

HttpRequest Removal(const std::string& body) {
  HttpRequest request;
  request.method = "POST";
  request.path = {"v1", "removals"};
  request.who = "kai";
  request.body.assign(body.begin(), body.end());
  return request;
}

HttpRequest RemovalOf(const ListedImage& image) {
  return Removal("{\"photos\": [\"#" + std::to_string(image.id.value) + "\"]}");
}

class RemovalsTest : public testing::Test {
 protected:
  RemovalsTest() { city_.Add(Walk(6, 0.9, 4)); }
  ~RemovalsTest() override { LetGo(); }

  // A pass that is at work until LetGo.
  DenseKeeping Held() {
    DenseKeeping keeping;
    keeping.is_wanted = true;
    keeping.request.device = "cpp";
    keeping.request.options.depth_side_px = 64;
    keeping.request.options.voxel_size = 0.2;
    keeping.request.report = [this](const DensifyReport&) {
      if (!std::exchange(is_held_, true)) at_work_.set_value();
      held_.wait();
    };
    keeping.pause_s = 1;
    return keeping;
  }
  void LetGo() {
    if (!std::exchange(is_let_go_, true)) let_go_.set_value();
  }

  City city_;
  std::promise<void> at_work_, let_go_;
  std::shared_future<void> held_ = let_go_.get_future().share();
  bool is_held_ = false, is_let_go_ = false;
};

TEST_F(RemovalsTest, WhatIsNotThereStopsNoPass) {
  DenseKeeper keeper(&city_.engine(), Held(), {});
  Removals removals(&city_.engine(), &keeper);
  at_work_.get_future().wait();
  EXPECT_EQ(removals.Answer(Removal("[]")).code, 400u);
  EXPECT_EQ(removals.Answer(Removal(std::string(5 << 20, '['))).code, 413u);
  EXPECT_EQ(removals.Answer(Removal("{\"photos\": 1}")).code, 400u);
  EXPECT_EQ(removals.Answer(Removal("{\"photos\": [\"none.jpg\"]}")).code, 404u);
  HttpRequest contribution;
  contribution.method = "DELETE";
  contribution.path = {"v1", "contributions", "7"};
  EXPECT_EQ(removals.Answer(contribution).code, 404u);
  LetGo();
  while (keeper.ToJson()["passes"] == 0) std::this_thread::sleep_for(std::chrono::milliseconds(20));
}

TEST_F(RemovalsTest, WhatIsThereWaitsForThePass) {
  DenseKeeper keeper(&city_.engine(), Held(), {});
  Removals removals(&city_.engine(), &keeper);
  at_work_.get_future().wait();
  const ListedImage image = city_.engine().Ask().Images(ImageId(1), 1)->at(0);
  auto removed = std::async(std::launch::async, [&] { return removals.Answer(RemovalOf(image)); });
  EXPECT_EQ(removed.wait_for(std::chrono::milliseconds(300)), std::future_status::timeout);
  LetGo();
  const HttpAnswer answer = removed.get();
  EXPECT_EQ(answer.code, 200u) << answer.body;
}

TEST_F(RemovalsTest, AStoppedOneSaysSo) {
  DenseKeeper keeper(&city_.engine(), {}, {});
  Removals removals(&city_.engine(), &keeper);
  removals.Stop();
  const ListedImage image = city_.engine().Ask().Images(ImageId(1), 1)->at(0);
  EXPECT_EQ(removals.Answer(RemovalOf(image)).code, 503u);
}

}  // namespace
}  // namespace veduta
