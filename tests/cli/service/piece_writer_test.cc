// SPDX-License-Identifier: Apache-2.0
// Goal: who reads slowly gets all of an answer, however long that takes; who does not read is cut
//   off.
// Method: pipes of kj with a clock of the test's own.
#include "cli/service/piece_writer.h"

#include <gtest/gtest.h>

#include <string>

namespace veduta {
namespace {

class PieceWriterTest : public testing::Test {
 protected:
  ~PieceWriterTest() noexcept override = default;

  kj::EventLoop loop_;
  kj::WaitScope scope_{loop_};
  kj::TimerImpl timer_{kj::origin<kj::TimePoint>()};
  kj::OneWayPipe pipe_ = kj::newOneWayPipe();
};

TEST_F(PieceWriterTest, WhoReadsSlowlyGetsAllOfIt) {
  std::string text(5 * kSendBytes + 7, 'a');
  for (size_t i = 0; i < text.size(); ++i) text[i] = static_cast<char>(i % 251);
  auto writing = WriteInPieces(&timer_, pipe_.out.get(), text)
                     .then([this] { pipe_.out = nullptr; })
                     .eagerlyEvaluate(nullptr);
  std::string read, piece(kSendBytes, ' ');
  while (size_t count = pipe_.in->tryRead(piece.data(), 1, piece.size()).wait(scope_)) {
    read.append(piece, 0, count);
    timer_.advanceTo(timer_.now() + kSendTime - 1 * kj::SECONDS);
  }
  EXPECT_EQ(read, text);
  writing.wait(scope_);
}

TEST_F(PieceWriterTest, WhoDoesNotReadIsCutOff) {
  const std::string text(2 * kSendBytes, 'a');
  auto writing = WriteInPieces(&timer_, pipe_.out.get(), text);
  EXPECT_FALSE(writing.poll(scope_));
  std::string piece(kSendBytes, ' ');
  pipe_.in->read(piece.data(), piece.size()).wait(scope_);
  timer_.advanceTo(timer_.now() + kSendTime - 1 * kj::SECONDS);
  EXPECT_FALSE(writing.poll(scope_)) << "the first piece was read";
  timer_.advanceTo(timer_.now() + kSendTime);
  EXPECT_THROW(writing.wait(scope_), kj::Exception);
}

TEST_F(PieceWriterTest, NothingIsWrittenAtOnce) {
  WriteInPieces(&timer_, pipe_.out.get(), "").wait(scope_);
}

}  // namespace
}  // namespace veduta
