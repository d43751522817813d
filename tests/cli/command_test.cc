// SPDX-License-Identifier: Apache-2.0
// Goal: a failure is one safe line on standard error with the exit code that the command line
//   promises; what is said of a step that failed names it and what to do.
// Method: every status code; steps of every kind, on an empty database.
#include "cli/command.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "cli/follow_ups.h"

namespace veduta {
namespace {

TEST(Fail, HasTheExitCodesOfTheCommandLine) {
  EXPECT_EQ(ExitCodeOf(Status::Ok()), 0);
  EXPECT_EQ(ExitCodeOf(Status::InvalidArgument("x")), 1);
  EXPECT_EQ(ExitCodeOf(Status::NotFound("x")), 1);
  EXPECT_EQ(ExitCodeOf(Status::AlreadyExists("x")), 1);
  EXPECT_EQ(ExitCodeOf(Status::IoError("x")), 1);
  EXPECT_EQ(ExitCodeOf(Status::Cancelled("x")), 1);
  EXPECT_EQ(ExitCodeOf(Status::Busy("x")), 3);
  EXPECT_EQ(ExitCodeOf(Status::Corruption("x")), 3);
}

TEST(Fail, SaysOneSafeLine) {
  testing::internal::CaptureStderr();
  EXPECT_EQ(Fail(Status::NotFound("there is no image 'a\x1b[31m\nb'")), 1);
  EXPECT_EQ(FailUsage(Status::Busy("used wrongly")), 2);
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            "veduta: there is no image 'a\\x1b[31m\\nb'\nveduta: used wrongly\n");
}

class OnADatabase : public testing::Test {
 protected:
  void SetUp() override {
    path_ = testing::TempDir() + "veduta_command_" + std::to_string(getpid());
    EngineOptions options;
    options.create = true;
    const auto made = Engine::Open(path_, options);
    ASSERT_TRUE(made.ok()) << made.status().message();
  }
  void TearDown() override { std::filesystem::remove_all(path_); }
  std::string path_;
};

TEST_F(OnADatabase, TwoMayReadAndOneMayWrite) {
  const auto writer = OpenToWrite(path_);
  ASSERT_TRUE(writer.ok()) << writer.status().message();
  EXPECT_EQ(OpenToWrite(path_).status().code(), StatusCode::kBusy);
  EXPECT_TRUE(OpenToRead(path_).ok());
  EXPECT_EQ(OpenToRead(path_ + "_missing").status().code(), StatusCode::kNotFound);
}

TEST_F(OnADatabase, AFailedStepIsNamedWithWhatToDo) {
  const auto engine = OpenToRead(path_);
  ASSERT_TRUE(engine.ok()) << engine.status().message();
  const Questions ask = (*engine)->Ask();
  FollowUp step;
  step.image = ImageId(7);
  EXPECT_EQ(FollowUpText(step, ask), "the new attempt to place #7");
  step.kind = FollowUpKind::kVocabulary;
  EXPECT_EQ(FollowUpText(step, ask), "the training of a vocabulary");
  step.kind = FollowUpKind::kJudgment;
  step.reconstruction = ReconstructionId(1);
  step.other = ReconstructionId(4);
  EXPECT_EQ(FollowUpText(step, ask), "the new judgment of whether reconstructions 1 and 4 are one");
  step.kind = FollowUpKind::kAdjustment;
  step.reconstruction = ReconstructionId(2);
  step.status = Status::IoError("the disk\nis full");
  EXPECT_EQ(FollowUpFailure(step, ask, "my.city"),
            "veduta: the adjustment of reconstruction 2 failed: the disk\\nis full; the photos are "
            "stored, and `veduta settle my.city` tries it again");
}

TEST(JoinedText, NamesBothAndTheOneThatTheyAreInNow) {
  FollowUp step;
  step.kind = FollowUpKind::kJudgment;
  step.reconstruction = ReconstructionId(1);
  step.other = ReconstructionId(4);
  EXPECT_EQ(JoinedText(step), "");
  step.merged_into = ReconstructionId(4);
  EXPECT_EQ(JoinedText(step),
            "reconstructions 1 and 4 are one by all that is known now: reconstruction 4");
}

TEST_F(OnADatabase, WhatAStepTookBackIsTold) {
  const auto engine = OpenToRead(path_);
  ASSERT_TRUE(engine.ok()) << engine.status().message();
  testing::internal::CaptureStdout();
  PrintHealed({{ImageId(7), "in reconstruction 1,\nit contradicts"}}, {ReconstructionId(3)},
              (*engine)->Ask());
  EXPECT_EQ(testing::internal::GetCapturedStdout(),
            "  then     #7: lost its pose: in reconstruction 1,\\nit contradicts\n"
            "  then     reconstruction 3 was split off\n");
}

}  // namespace
}  // namespace veduta
