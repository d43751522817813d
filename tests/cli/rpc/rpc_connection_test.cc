// SPDX-License-Identifier: Apache-2.0
// Goal: Cap'n Proto's own client in C++ is understood: calls are pipelined, photos are streamed,
//   what is dropped, and a photo that nobody asks about any more, is given back; a connection that
//   does not log in, rests too long, or does not read its answers, is closed.
// Method: a service of a database of the test's own, both ends of a connection in one thread, and
//   limits of tenths of a second.
#include "cli/rpc/rpc_connection.h"

#include <capnp/rpc.capnp.h>
#include <capnp/serialize.h>
#include <gtest/gtest.h>

#include "cli/rpc/veduta.capnp.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

// How long what a test limits may take; all else may take as long as the machine wants.
constexpr kj::Duration kShort = 300 * kj::MILLISECONDS;

ConnectionLimits LookingOften() {
  ConnectionLimits limits;
  limits.look_time = 20 * kj::MILLISECONDS;
  return limits;
}

class RpcConnectionTest : public testing::Test {
 public:
  ~RpcConnectionTest() noexcept override {}

 protected:
  RpcConnectionTest() {
    city_.Close();
    auto engine = Engine::Open(city_.path());
    EXPECT_OK(engine);
    service_ = std::make_unique<CityService>(*std::move(engine), city_.path(), ServiceOptions(),
                                             CityService::Listeners());
    shared_ = std::make_unique<RpcShared>(service_.get(), 1, 512ull << 20);
  }

  // One connection, with Cap'n Proto's client at its other end.
  struct Line {
    std::shared_ptr<RpcSession> session;
    kj::Own<RpcConnection> connection;
    kj::Promise<void> running = nullptr;
    kj::Own<kj::AsyncIoStream> stream;
    kj::Own<capnp::TwoPartyClient> client;
    bool has_ended = false;
  };
  // `timer`: the connection's; null: the clock.
  std::unique_ptr<Line> Connect(const ConnectionLimits& limits = {}, kj::Timer* timer = nullptr) {
    auto line = std::make_unique<Line>();
    auto pipe = io_.provider->newTwoWayPipe();
    line->session = std::make_shared<RpcSession>(*shared_, timer == nullptr ? &Clock() : timer,
                                                 &is_stopping_, true);
    line->connection = kj::heap<RpcConnection>(kj::mv(pipe.ends[0]), line->session, limits);
    line->running = line->connection->Run()
                        .then([l = line.get()] { l->has_ended = true; })
                        .eagerlyEvaluate(nullptr);
    line->stream = kj::mv(pipe.ends[1]);
    return line;
  }
  rpc::City::Client LogIn(Line* line) {
    line->client = kj::heap<capnp::TwoPartyClient>(*line->stream);
    return line->client->bootstrap().castAs<rpc::Gate>().loginRequest().send().getCity();
  }

  kj::Timer& Clock() { return io_.provider->getTimer(); }
  void Pass(kj::Duration time) { Clock().afterDelay(time).wait(io_.waitScope); }
  // Whether the connection ends within five seconds.
  bool Ends(Line* line) {
    for (int i = 0; i < 500 && !line->has_ended; ++i) Pass(10 * kj::MILLISECONDS);
    return line->has_ended;
  }

  City city_;
  kj::AsyncIoContext io_ = kj::setupAsyncIo();
  bool is_stopping_ = false;
  std::unique_ptr<CityService> service_;
  std::unique_ptr<RpcShared> shared_;
};

TEST_F(RpcConnectionTest, APhotoAndItsVerdictAreOneJourney) {
  const auto line = Connect();
  auto city = LogIn(line.get());
  const TakenPhoto& photo = TakePhoto(Walk(0, 1, 1).front());
  auto asking = city.addPhotoRequest();
  asking.setName("a.jpg");
  asking.setCamera("street");
  auto upload = asking.send().getUpload();
  constexpr size_t kChunk = 4096;
  for (size_t at = 0; at < photo.jpeg.size(); at += kChunk) {
    auto write = upload.writeRequest();
    const size_t size = std::min(kChunk, photo.jpeg.size() - at);
    write.setChunk(kj::arrayPtr(photo.jpeg.data() + at, size));
    write.send().wait(io_.waitScope);
  }
  auto done = upload.doneRequest().send();
  auto verdict = done.getTicket().verdictRequest().send();
  EXPECT_EQ(done.wait(io_.waitScope).getNumber(), 1u);
  const auto outcome = verdict.wait(io_.waitScope);
  EXPECT_EQ(outcome.getOutcome().getVerdict(), rpc::Verdict::POSTPONED);
  EXPECT_EQ(outcome.getOutcome().getId(), 1u);
  EXPECT_GT(outcome.getSnapshot(), 0u);
  EXPECT_EQ(shared_->bytes->used(), 0u);  // the photo is on the disk
}

TEST_F(RpcConnectionTest, WhatIsDroppedIsGivenBack) {
  const auto line = Connect();
  auto city = LogIn(line.get());
  {
    auto asking = city.examineRequest();
    auto examination = asking.send().getExamination();
    auto write = examination.writeRequest();
    write.initChunk(1000);
    write.send().wait(io_.waitScope);
    examination.whenResolved().wait(io_.waitScope);
    EXPECT_EQ(shared_->bytes->used(), 1000u);
    EXPECT_EQ(line->session->things->used(), 2u);  // with the city
  }
  Pass(50 * kj::MILLISECONDS);
  EXPECT_EQ(shared_->bytes->used(), 0u);
  EXPECT_EQ(line->session->things->used(), 1u);
  line->client = nullptr;
  line->stream->shutdownWrite();
  EXPECT_TRUE(Ends(line.get()));
}

TEST_F(RpcConnectionTest, APhotoThatNobodyAsksAboutIsDropped) {
  kj::TimerImpl clock(kj::origin<kj::TimePoint>());
  ConnectionLimits limits;
  limits.rest_time = 10 * kj::HOURS;  // other calls keep a connection
  const auto line = Connect(limits, &clock);
  auto examination = LogIn(line.get()).examineRequest().send().getExamination();
  auto write = examination.writeRequest();
  write.initChunk(1000);
  write.send().wait(io_.waitScope);
  const auto ask = [&]() -> std::string {
    KJ_IF_MAYBE (failure, kj::runCatchingExceptions([&] {
                   examination.candidatesRequest().send().wait(io_.waitScope);
                 })) {
      return failure->getDescription().cStr();
    }
    return "";
  };
  const auto pass = [&](kj::Duration time) {
    clock.advanceTo(clock.now() + time);
    Pass(50 * kj::MILLISECONDS);
  };
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(ask().find("408"), std::string::npos) << i;  // it is no photo
    pass(9 * kj::MINUTES);
    EXPECT_EQ(shared_->bytes->used(), 1000u) << i;
  }
  pass(2 * kj::MINUTES);
  EXPECT_EQ(shared_->bytes->used(), 0u);
  EXPECT_NE(ask().find("408"), std::string::npos);
}

TEST_F(RpcConnectionTest, WhoDoesNotLogInIsDisconnected) {
  ConnectionLimits limits = LookingOften();
  limits.login_time = kShort;
  const auto silent = Connect(limits), asking = Connect(limits);
  asking->client = kj::heap<capnp::TwoPartyClient>(*asking->stream);
  auto gate = asking->client->bootstrap().castAs<rpc::Gate>();
  gate.whenResolved().wait(io_.waitScope);
  EXPECT_TRUE(Ends(silent.get()));
  EXPECT_TRUE(Ends(asking.get()));
}

TEST_F(RpcConnectionTest, WhoRestsIsDisconnectedUnlessACallWaits) {
  class Deaf final : public rpc::Watcher::Server {};
  ConnectionLimits limits = LookingOften();
  limits.rest_time = kShort;
  const auto resting = Connect(limits), following = Connect(limits);
  auto city = LogIn(resting.get()), other = LogIn(following.get());
  auto follow = other.followRequest();
  follow.setFrom(1'000'000);
  follow.setWatcher(kj::heap<Deaf>());
  const auto call = follow.send();
  city.statusRequest().send().wait(io_.waitScope);
  EXPECT_TRUE(Ends(resting.get()));
  Pass(1 * kj::SECONDS);
  EXPECT_FALSE(following->has_ended);
}

// A call by hand of what the question has promised, in its first pointer where it is not the
// bootstrap; the message of its parameters is empty but for the text.
kj::Array<capnp::word> CallByHand(uint32_t question, uint64_t interface, uint16_t method,
                                  uint32_t of, const std::string& text) {
  capnp::MallocMessageBuilder message;
  auto call = message.initRoot<capnp::rpc::Message>().initCall();
  call.setQuestionId(question);
  auto target = call.initTarget().initPromisedAnswer();
  target.setQuestionId(of);
  if (of != 0) target.initTransform(1)[0].setGetPointerField(0);
  call.setInterfaceId(interface);
  call.setMethodId(method);
  call.initParams().getContent().initAs<rpc::City::PoseParams>().setPhoto(text.c_str());
  return capnp::messageToFlatArray(message);
}

// Asks so much that the answers, which repeat the names, are more than a socket holds.
kj::Promise<void> AskMuch(kj::AsyncIoStream* stream) {
  capnp::MallocMessageBuilder bootstrap;
  bootstrap.initRoot<capnp::rpc::Message>().initBootstrap().setQuestionId(0);
  std::vector<kj::Array<capnp::word>> sent;
  sent.push_back(capnp::messageToFlatArray(bootstrap));
  sent.push_back(CallByHand(1, capnp::typeId<rpc::Gate>(), 0, 0, ""));
  for (uint32_t question = 2; question < 900; ++question) {
    sent.push_back(CallByHand(question, capnp::typeId<rpc::City>(), 3, 1, std::string(3000, 'x')));
  }
  kj::Promise<void> sending = kj::READY_NOW;
  for (const auto& message : sent) {
    const auto bytes = message.asBytes();
    sending = sending.then([stream, bytes] { return stream->write(bytes.begin(), bytes.size()); });
  }
  return sending.attach(kj::mv(sent)).eagerlyEvaluate([](kj::Exception&&) {});
}

TEST_F(RpcConnectionTest, WhoDoesNotReadIsDisconnected) {
  ConnectionLimits limits = LookingOften();
  limits.read_time = kShort;
  const auto line = Connect(limits);
  const auto sending = AskMuch(line->stream.get());
  EXPECT_TRUE(Ends(line.get()));
  EXPECT_TRUE(line->session->has_logged_in);
}
TEST_F(RpcConnectionTest, AnswersThatWaitToBeSentAreWork) {
  const auto line = Connect();
  EXPECT_FALSE(line->connection->is_at_work());
  const auto sending = AskMuch(line->stream.get());
  const auto is_unsent = [&] {
    return line->session->calls->used() == 0 && line->connection->is_at_work();
  };
  for (int i = 0; i < 500 && !is_unsent(); ++i) Pass(10 * kj::MILLISECONDS);
  EXPECT_TRUE(is_unsent());
}

}  // namespace
}  // namespace veduta
