// SPDX-License-Identifier: Apache-2.0
// Goal: areas are taken from an answer that says them soundly, and from no other; a program that
//   hangs is ended with all that it has started.
// Method: answers that are right and wrong in one thing each; shell scripts as programs.
#include "engine/photo/blur_command.h"

#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

const ImageSize kPicture{640, 480};

std::string Answer(const std::string& areas) {
  return R"({"width": 640, "height": 480, "areas": )" + areas + "}";
}

TEST(BlurAnswer, HasAreasWithinThePicture) {
  const auto areas = ParseBlurAnswer(Answer("[[1, 2, 3, 4], [-5.5, 470.2, 10, 100]]"), kPicture);
  ASSERT_OK(areas);
  EXPECT_EQ(*areas, (std::vector<PixelArea>{{1, 2, 3, 4}, {0, 470, 5, 10}}));
  const auto none = ParseBlurAnswer(Answer("[]"), kPicture);
  ASSERT_OK(none);
  EXPECT_TRUE(none->empty());
}

TEST(BlurAnswer, WhatIsWrongIsRefused) {
  std::string many = "[";
  for (size_t i = 0; i <= kPrivateAreasMax; ++i) many += i == 0 ? "[1,1,1,1]" : ",[1,1,1,1]";
  for (const std::string& answer :
       {std::string(), std::string("[]"), std::string("null"), std::string("[[1,2,3,4]]"),
        Answer("[[1,2,3]]"), Answer("[[1,2,3,0]]"), Answer("[[1,2,-3,4]]"), Answer("{}"),
        Answer("[[640,0,1,1]]"), Answer("[[0,0,1,1e400]]"), Answer("[[\"1\",2,3,4]]"),
        Answer("[[[[[1]]]]]"), Answer(many + "]"), Answer("[]").substr(0, 20),
        Answer("[]") + Answer("[]"), std::string(R"({"width": 320, "height": 240, "areas": []})"),
        std::string(R"({"width": 480, "height": 640, "areas": []})"),
        std::string(R"({"areas": []})")}) {
    const auto areas = ParseBlurAnswer(answer, kPicture);
    EXPECT_EQ(areas.status().code(), StatusCode::kInvalidArgument) << answer.substr(0, 100);
  }
}

std::string Program(const std::string& name, const std::string& text) {
  const std::string path = ::testing::TempDir() + "veduta_" + name;
  std::ofstream(path) << "#!/bin/sh\n" << text << "\n";
  std::filesystem::permissions(path, std::filesystem::perms::owner_all);
  return path;
}

TEST(BlurCommand, GetsThePictureAndNothingElse) {
  const std::string bytes = "a picture";
  const std::vector<uint8_t> picture(bytes.begin(), bytes.end());
  const std::atomic<bool> stop = false;
  const std::string program = Program(
      "reads", "[ \"$(cat)\" = 'a picture' ] && [ $# = 0 ] && [ ! -e /proc/self/fd/4 ] && echo '" +
                   Answer("[[1,2,3,4]]") + "'");
  const auto areas = AskBlurCommand(program, picture, kPicture, {}, stop);
  ASSERT_OK(areas);
  EXPECT_EQ(*areas, (std::vector<PixelArea>{{1, 2, 3, 4}}));
}

TEST(BlurCommand, EndsWithAllThatItStarted) {
  const std::string pid_file = ::testing::TempDir() + "veduta_child_pid";
  const std::atomic<bool> stop = false;
  const auto areas =
      AskBlurCommand(Program("hangs", "sleep 1000 & echo $! > " + pid_file + "; wait"), {{1}},
                     kPicture, {.time_max = std::chrono::milliseconds(500)}, stop);
  EXPECT_EQ(areas.status().code(), StatusCode::kBusy);
  EXPECT_NE(areas.status().message().find("longer than"), std::string::npos);
  pid_t child = 0;
  std::ifstream(pid_file) >> child;
  ASSERT_GT(child, 0);
  for (int i = 0; i < 100 && kill(child, 0) == 0; ++i) {
    std::ifstream stat("/proc/" + std::to_string(child) + "/stat");
    std::string text((std::istreambuf_iterator<char>(stat)), {});
    if (text.find(") Z ") != std::string::npos) return;  // killed; whoever adopts it is slow
    usleep(50'000);
  }
  EXPECT_NE(kill(child, 0), 0);
}

TEST(BlurCommand, SaysWhyThereIsNoAnswer) {
  const std::atomic<bool> go = false, stop = true;
  const auto why = [&](const std::string& program, const std::atomic<bool>& stopped) {
    const auto areas = AskBlurCommand(program, {{1}}, kPicture, {}, stopped);
    EXPECT_EQ(areas.status().code(), StatusCode::kBusy);
    return areas.status().message();
  };
  EXPECT_NE(why("/no/such/program", go).find("cannot be started"), std::string::npos);
  EXPECT_NE(why(Program("fails", "exit 7"), go).find("exit code 7"), std::string::npos);
  EXPECT_NE(why(Program("chats", "yes"), go).find("says more"), std::string::npos);
  EXPECT_NE(why(Program("silent", ""), go).find("no JSON"), std::string::npos);
  EXPECT_NE(why(Program("any", ""), stop).find("closed"), std::string::npos);
}

}  // namespace
}  // namespace veduta
