// SPDX-License-Identifier: Apache-2.0
// Goal: bodies are read whole or in parts, to the last byte, and no further than the limits; what
//   has come before a connection breaks is there.
// Method: pipes of kj with a clock of the test's own; budgets that others use up.
#include "cli/service/body_reader.h"

#include <gtest/gtest.h>
#include <kj/async-io.h>

#include <numeric>

namespace veduta {
namespace {

class BodyReaderTest : public testing::Test {
 protected:
  ~BodyReaderTest() noexcept override = default;

  std::shared_ptr<Arriving> New() { return std::make_shared<Arriving>(budget_); }
  // The bytes 0, 1, 2, ... written into the pipe, then its end; never done where nobody reads.
  void Write(size_t size) {
    sent_.resize(size);
    std::iota(sent_.begin(), sent_.end(), 0);
    writing_ = pipe_.out->write(sent_.data(), sent_.size())
                   .then([this] { pipe_.out = nullptr; })
                   .eagerlyEvaluate(nullptr);
  }

  kj::EventLoop loop_;
  kj::WaitScope scope_{loop_};
  kj::TimerImpl timer_{kj::origin<kj::TimePoint>()};
  std::shared_ptr<DividedBudget> budget_ = std::make_shared<DividedBudget>(3'000'000);
  BodyReader reader_{&timer_, 2'500'000};
  kj::OneWayPipe pipe_ = kj::newOneWayPipe();
  std::vector<uint8_t> sent_;
  kj::Promise<void> writing_ = kj::READY_NOW;
};

TEST_F(BodyReaderTest, ReadsTheWholeBody) {
  Write(2'000'000);
  const auto arriving = New();
  reader_.ReadAll(*pipe_.in, arriving).wait(scope_);
  EXPECT_FALSE(arriving->refusal);
  EXPECT_TRUE(arriving->has_ended);
  EXPECT_EQ(arriving->request.body, sent_);
  EXPECT_EQ(arriving->share->taken(), sent_.size());
}

TEST_F(BodyReaderTest, ReadsPartAfterPart) {
  Write(2'000'000);
  std::vector<uint8_t> read;
  for (bool has_ended = false; !has_ended;) {
    const auto arriving = New();
    reader_.ReadPart(*pipe_.in, arriving).wait(scope_);
    ASSERT_FALSE(arriving->refusal);
    EXPECT_LE(arriving->request.body.size(), 1u << 20);
    has_ended = arriving->has_ended;
    if (!has_ended) {
      EXPECT_GE(arriving->request.body.size(), 768u << 10);
    }
    read.insert(read.end(), arriving->request.body.begin(), arriving->request.body.end());
  }
  EXPECT_EQ(read, sent_);
}

TEST_F(BodyReaderTest, RefusesWhatIsTooLarge) {
  Write(2'600'000);
  const auto arriving = New();
  reader_.ReadAll(*pipe_.in, arriving).wait(scope_);
  ASSERT_TRUE(arriving->refusal);
  EXPECT_EQ(arriving->refusal->code, 413u);
}

TEST_F(BodyReaderTest, WaitsForNoBodyWhereThereMayBeNone) {
  const BodyReader none(&timer_, 0);
  const auto arriving = New();  // by chunks: nobody has said how much comes
  none.ReadAll(*pipe_.in, arriving).wait(scope_);
  ASSERT_TRUE(arriving->refusal);
  EXPECT_EQ(arriving->refusal->code, 413u);
}

TEST_F(BodyReaderTest, RefusesWhatTheBudgetHasNoRoomFor) {
  ASSERT_TRUE(budget_->Grow("", 0, 2'900'000));
  Write(200'000);
  auto arriving = New();
  reader_.ReadAll(*pipe_.in, arriving).wait(scope_);
  ASSERT_TRUE(arriving->refusal);
  EXPECT_EQ(arriving->refusal->code, 429u);
  EXPECT_EQ(HeaderOf(*arriving->refusal, "Retry-After"), "5");
  EXPECT_FALSE(budget_->Grow("", 0, 200'000));
  budget_->Give("", 2'900'000);
  arriving.reset();
  EXPECT_TRUE(budget_->Grow("", 0, 3'000'000)) << "its share was given back";
}

TEST_F(BodyReaderTest, SmallBodiesAndTheOwnersAreTakenAllTheSame) {
  ASSERT_TRUE(budget_->Grow("", 0, 3'000'000));
  Write(60'000);
  auto arriving = New();
  reader_.ReadAll(*pipe_.in, arriving).wait(scope_);
  EXPECT_FALSE(arriving->refusal);
  EXPECT_EQ(arriving->come_bytes, 60'000u);
  EXPECT_EQ(arriving->request.body, sent_);
  pipe_ = kj::newOneWayPipe();
  Write(2'000'000);
  arriving = New();
  arriving->request.is_of_owner = true;
  reader_.ReadAll(*pipe_.in, arriving).wait(scope_);
  EXPECT_FALSE(arriving->refusal);
  EXPECT_EQ(arriving->request.body, sent_);
  arriving.reset();
  EXPECT_EQ(budget_->used(), 3'000'000u) << "nothing is given back that was not taken";
}

TEST_F(BodyReaderTest, WhatHasComeIsThereWhenNoMoreComes) {
  sent_ = std::vector<uint8_t>(1'000, 7);
  writing_ = pipe_.out->write(sent_.data(), sent_.size()).eagerlyEvaluate(nullptr);
  const auto arriving = New();
  auto reading = reader_.ReadPart(*pipe_.in, arriving);
  EXPECT_FALSE(reading.poll(scope_));
  timer_.advanceTo(timer_.now() + 31 * kj::SECONDS);
  EXPECT_THROW(reading.wait(scope_), kj::Exception);
  EXPECT_EQ(arriving->come_bytes, 1'000u);
  EXPECT_FALSE(arriving->has_ended);
}

}  // namespace
}  // namespace veduta
