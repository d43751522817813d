// SPDX-License-Identifier: Apache-2.0
// Goal: points are told in chunks, each once and in order, and are dropped where nobody reads them
//   for 10 minutes.
// Method: points of the test's own, a clock that the test sets, and Cap'n Proto's client in the
//   same thread.
#include "cli/rpc/point_reader_server.h"

#include <gtest/gtest.h>
#include <kj/async-io.h>

#include <cstring>

#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

constexpr size_t kPoints = 10, kPointBytes = 16, kHeldBytes = 1000;

class PointReaderServerTest : public testing::Test {
 public:
  ~PointReaderServerTest() noexcept override {}

 protected:
  PointReaderServerTest() {
    city_.Close();
    auto engine = Engine::Open(city_.path());
    EXPECT_OK(engine);
    service_ = std::make_unique<CityService>(*std::move(engine), city_.path(), ServiceOptions(),
                                             CityService::Listeners());
    shared_ = std::make_unique<RpcShared>(service_.get(), 1, 1ull << 20);
    session_ = std::make_shared<RpcSession>(*shared_, &clock_, &is_stopping_, true);
  }

  // Reads points whose x is 0, 1, 2 ... and whose red is that too.
  rpc::PointReader::Client Reader() {
    Caller caller(session_, "");
    caller.LogIn();
    HeldPoints held;
    held.share = caller.NewShare();
    EXPECT_TRUE(held.share->Grow(kHeldBytes));
    for (size_t i = 0; i < kPoints; ++i) {
      held.cloud.positions.push_back({static_cast<float>(i), 0, 0});
      held.cloud.rgb.push_back({static_cast<uint8_t>(i), 0, 0});
    }
    return kj::heap<PointReaderServer>(caller, std::make_shared<HeldPoints>(std::move(held)));
  }
  // The x of at most `count` points; what it threw goes to `failure`.
  std::vector<float> Next(rpc::PointReader::Client* reader, uint32_t count,
                          std::string* failure = nullptr) {
    std::vector<float> found;
    KJ_IF_MAYBE (thrown, kj::runCatchingExceptions([&] {
                   auto asking = reader->nextRequest();
                   asking.setCount(count);
                   const auto answer = asking.send().wait(io_.waitScope);
                   const auto points = answer.getPoints();
                   for (size_t at = 0; at + kPointBytes <= points.size(); at += kPointBytes) {
                     std::memcpy(&found.emplace_back(), points.begin() + at, sizeof(float));
                     EXPECT_EQ(points[at + 12], static_cast<uint8_t>(found.back()));
                   }
                 })) {
      if (failure != nullptr) *failure = thrown->getDescription().cStr();
    }
    return found;
  }
  void Pass(kj::Duration time) {
    clock_.advanceTo(clock_.now() + time);
    io_.provider->getTimer().afterDelay(10 * kj::MILLISECONDS).wait(io_.waitScope);
  }

  City city_;
  kj::AsyncIoContext io_ = kj::setupAsyncIo();
  kj::TimerImpl clock_{kj::origin<kj::TimePoint>()};
  bool is_stopping_ = false;
  std::unique_ptr<CityService> service_;
  std::unique_ptr<RpcShared> shared_;
  std::shared_ptr<RpcSession> session_;
};

TEST_F(PointReaderServerTest, EachPointIsToldOnceInOrder) {
  auto reader = Reader();
  EXPECT_EQ(Next(&reader, 4), (std::vector<float>{0, 1, 2, 3}));
  EXPECT_EQ(Next(&reader, 0), (std::vector<float>{4, 5, 6, 7, 8, 9}));
  EXPECT_TRUE(Next(&reader, 0).empty());
}

TEST_F(PointReaderServerTest, PointsThatNobodyReadsAreDropped) {
  auto reader = Reader();
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(Next(&reader, 1).size(), 1u);
    Pass(9 * kj::MINUTES);
    EXPECT_EQ(shared_->bytes->used(), kHeldBytes);
  }
  Pass(2 * kj::MINUTES);
  EXPECT_EQ(shared_->bytes->used(), 0u);
  std::string failure;
  EXPECT_TRUE(Next(&reader, 1, &failure).empty());
  EXPECT_NE(failure.find("408"), std::string::npos) << failure;
}

}  // namespace
}  // namespace veduta
