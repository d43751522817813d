// SPDX-License-Identifier: Apache-2.0
// Goal: messages arrive as they were sent, however they are cut; those that are too long, of too
//   many segments, too slow, or that leave too many questions open end the reading.
// Method: a pipe in memory, bytes written by hand, and a clock that the test moves.
#include "cli/rpc/guarded_stream.h"

#include <capnp/message.h>
#include <capnp/rpc.capnp.h>
#include <capnp/serialize.h>
#include <gtest/gtest.h>
#include <kj/async-io.h>

#include <list>
#include <string>
#include <vector>

namespace veduta {
namespace {

class GuardedStreamTest : public testing::Test {
 public:
  ~GuardedStreamTest() noexcept override {}

 protected:
  static kj::Array<capnp::word> Finish(uint32_t question) {
    capnp::MallocMessageBuilder message;
    message.initRoot<capnp::rpc::Message>().initFinish().setQuestionId(question);
    return capnp::messageToFlatArray(message);
  }
  static kj::Array<capnp::word> Bootstrap(uint32_t question) {
    capnp::MallocMessageBuilder message;
    message.initRoot<capnp::rpc::Message>().initBootstrap().setQuestionId(question);
    return capnp::messageToFlatArray(message);
  }

  void Send(kj::ArrayPtr<const kj::byte> bytes) {
    sent_.push_back(kj::heapArray(bytes));
    auto* const data = &sent_.back();
    sending_ =
        sending_.then([this, data] { return pipe_.ends[1]->write(data->begin(), data->size()); })
            .eagerlyEvaluate([](kj::Exception&&) {});
  }
  // "": a message came, or is on its way; otherwise why the reading ended.
  std::string Read() {
    bool came = false;
    std::string failure;
    auto reading = stream_.tryReadMessage(nullptr, capnp::ReaderOptions(), nullptr)
                       .then(
                           [&](kj::Maybe<capnp::MessageReaderAndFds> message) {
                             came = true;
                             if (message == nullptr) failure = "the end";
                           },
                           [&](kj::Exception&& e) { failure = e.getDescription().cStr(); })
                       .eagerlyEvaluate(nullptr);
    wait_scope_.poll();
    for (int s = 0; s < 40 && !came && failure.empty(); ++s) {
      clock_.advanceTo(clock_.now() + 1 * kj::SECONDS);
      wait_scope_.poll();
    }
    return came || !failure.empty() ? failure : "nothing in 40 s";
  }

  kj::EventLoop loop_;
  kj::WaitScope wait_scope_{loop_};
  kj::TimerImpl clock_{kj::origin<kj::TimePoint>()};
  kj::TwoWayPipe pipe_ = kj::newTwoWayPipe();
  std::list<kj::Array<kj::byte>> sent_;
  kj::Promise<void> sending_ = kj::READY_NOW;
  GuardedStream stream_{pipe_.ends[0].get(), &clock_, {.questions_max = 3}};
};

TEST_F(GuardedStreamTest, AMessageMayComeByteByByte) {
  const auto message = Finish(7);
  for (const kj::byte& byte : message.asBytes()) Send(kj::arrayPtr(&byte, 1));
  EXPECT_EQ(Read(), "");
  Send(message.asBytes());
  EXPECT_EQ(Read(), "");
  pipe_.ends[1]->shutdownWrite();
  EXPECT_EQ(Read(), "the end");
}

TEST_F(GuardedStreamTest, ManyMessagesMayComeAtOnce) {
  std::string bytes;
  for (uint32_t i = 0; i < 500; ++i) {  // more than are read at once, the last one by half
    const auto message = Finish(i);
    bytes.append(reinterpret_cast<const char*>(message.begin()), message.asBytes().size());
  }
  bytes.resize(bytes.size() - 5);
  Send(kj::arrayPtr(reinterpret_cast<const kj::byte*>(bytes.data()), bytes.size()));
  for (uint32_t i = 0; i < 499; ++i) EXPECT_EQ(Read(), "");
  EXPECT_EQ(Read(), "operation timed out");
}

TEST_F(GuardedStreamTest, ManySegmentsAreOneMessage) {
  // Each word of the root is in a segment of its own.
  capnp::MallocMessageBuilder message(1, capnp::AllocationStrategy::FIXED_SIZE);
  message.initRoot<capnp::rpc::Message>().initFinish().setQuestionId(7);
  ASSERT_GT(message.getSegmentsForOutput().size(), 1u);
  Send(capnp::messageToFlatArray(message).asBytes());
  EXPECT_EQ(Read(), "");
}

TEST_F(GuardedStreamTest, HalfAMessageIsGivenUp) {
  for (const size_t size : {3u, 8u, 12u}) {
    kj::TwoWayPipe pipe = kj::newTwoWayPipe();
    GuardedStream stream(pipe.ends[0].get(), &clock_);
    const auto message = Finish(7);
    const auto sending = pipe.ends[1]->write(message.begin(), size).eagerlyEvaluate(nullptr);
    bool failed = false;
    auto reading = stream.tryReadMessage(nullptr, capnp::ReaderOptions(), nullptr)
                       .then([](auto&&) {}, [&](kj::Exception&&) { failed = true; })
                       .eagerlyEvaluate(nullptr);
    wait_scope_.poll();
    clock_.advanceTo(clock_.now() + 29 * kj::SECONDS);
    wait_scope_.poll();
    EXPECT_FALSE(failed);
    clock_.advanceTo(clock_.now() + 2 * kj::SECONDS);
    wait_scope_.poll();
    EXPECT_TRUE(failed) << size;
  }
}

TEST_F(GuardedStreamTest, WhoSendsNothingIsWaitedFor) {
  EXPECT_EQ(Read(), "nothing in 40 s");
}

TEST_F(GuardedStreamTest, LongMessagesAreRefusedBeforeTheyCome) {
  for (const auto& head : std::vector<std::vector<uint32_t>>{
           {0, 0x7fffffff}, {0, 128 << 10}, {64, 1}, {0xffffffff, 1}, {1, 1, 128 << 10, 0}}) {
    kj::TwoWayPipe pipe = kj::newTwoWayPipe();
    GuardedStream stream(pipe.ends[0].get(), &clock_);
    const auto sending =
        pipe.ends[1]->write(head.data(), 4 * head.size()).eagerlyEvaluate([](kj::Exception&&) {});
    std::string failure;
    auto reading =
        stream.tryReadMessage(nullptr, capnp::ReaderOptions(), nullptr)
            .then([](auto&&) {}, [&](kj::Exception&& e) { failure = e.getDescription().cStr(); })
            .eagerlyEvaluate(nullptr);
    wait_scope_.poll();
    EXPECT_TRUE(failure.starts_with("413 Content Too Large")) << failure;
  }
}

TEST_F(GuardedStreamTest, OpenQuestionsAreCounted) {
  for (uint32_t i = 0; i < 10; ++i) {
    Send(Bootstrap(i).asBytes());
    EXPECT_EQ(Read(), "");
    Send(Finish(i).asBytes());
    EXPECT_EQ(Read(), "");
  }
  for (uint32_t i = 0; i < 3; ++i) {
    Send(Bootstrap(i).asBytes());
    Send(Finish(77).asBytes());  // of no question
    EXPECT_EQ(Read(), "");
    EXPECT_EQ(Read(), "");
  }
  Send(Bootstrap(3).asBytes());
  EXPECT_TRUE(Read().starts_with("429 Too Many Requests"));
}

TEST_F(GuardedStreamTest, WhoDoesNotReadIsNotListenedTo) {
  size_t queue = 5 << 20;
  stream_.AskQueue([&] { return queue; });
  Send(Finish(1).asBytes());
  EXPECT_EQ(Read(), "nothing in 40 s");
  queue = 0;
  EXPECT_EQ(Read(), "");
}

TEST_F(GuardedStreamTest, WhoHasNotLoggedInIsListenedToLess) {
  bool is_stranger = true;
  size_t queue = 65 << 10;
  stream_.AskQueue([&] { return queue; });
  stream_.AskStranger([&] { return is_stranger; });
  Send(Finish(1).asBytes());
  EXPECT_EQ(Read(), "nothing in 40 s");
  is_stranger = false;
  EXPECT_EQ(Read(), "");
}

TEST_F(GuardedStreamTest, LongMessagesWaitForTheLoginBeforeThem) {
  for (const bool logs_in : {true, false}) {
    kj::TwoWayPipe pipe = kj::newTwoWayPipe();
    GuardedStream stream(pipe.ends[0].get(), &clock_);
    bool is_stranger = true;
    stream.AskStranger([&] { return is_stranger; });
    capnp::MallocMessageBuilder message;  // one segment of just more than 16 KiB
    message.initRoot<capnp::rpc::Message>()
        .initCall()
        .initParams()
        .getContent()
        .initAs<capnp::Data>(16 << 10);
    const auto words = capnp::messageToFlatArray(message);
    const auto sending = pipe.ends[1]
                             ->write(words.begin(), words.asBytes().size())
                             .eagerlyEvaluate([](kj::Exception&&) {});
    std::string end;
    auto reading =
        stream.tryReadMessage(nullptr, capnp::ReaderOptions(), nullptr)
            .then([&](auto&&) { end = "read"; }, [&](kj::Exception&&) { end = "given up"; })
            .eagerlyEvaluate(nullptr);
    wait_scope_.poll();
    EXPECT_EQ(end, "");
    is_stranger = !logs_in;
    for (int s = 0; s < 31; ++s) {
      clock_.advanceTo(clock_.now() + 1 * kj::SECONDS);
      wait_scope_.poll();
    }
    EXPECT_EQ(end, logs_in ? "read" : "given up");
  }
}

}  // namespace
}  // namespace veduta
