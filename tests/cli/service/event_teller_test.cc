// SPDX-License-Identifier: Apache-2.0
// Goal: who follows the city is told of each entry from the wanted one on, and of those that come,
//   until the daemon stops.
// Method: a service of a database of the test's own, a pipe, and the loop of a thread of the door.
#include "cli/service/event_teller.h"

#include <gtest/gtest.h>

#include "cli/service/event_loop.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

class EventTellerTest : public testing::Test {
 protected:
  EventTellerTest() {
    city_.Close();
    auto engine = Engine::Open(city_.path());
    EXPECT_OK(engine);
    engine_ = engine->get();
    service_ = std::make_unique<CityService>(*std::move(engine), city_.path(), ServiceOptions(),
                                             CityService::Listeners());
  }
  ~EventTellerTest() noexcept override = default;

  // Reads until the text was told.
  void ExpectTold(const std::string& text) {
    while (told_.find(text) == std::string::npos) {
      char piece[1000];
      const size_t count = pipe_.in->tryRead(piece, 1, sizeof(piece)).wait(io_.waitScope);
      told_.append(piece, count);
      ASSERT_GT(count, 0u) << told_;
    }
  }

  City city_;
  kj::AsyncIoContext io_ = MakeEventLoop();
  bool is_stopping_ = false;
  Engine* engine_ = nullptr;  // the service's
  std::unique_ptr<CityService> service_;
  kj::OneWayPipe pipe_ = kj::newOneWayPipe();
  std::string told_;
};

TEST_F(EventTellerTest, TellsWhatIsThereAndWhatComes) {
  const EventTeller teller(service_.get(), &io_.provider->getTimer(), &is_stopping_);
  HttpRequest request;
  request.method = "GET";
  request.path = {"v1", "events"};
  auto telling = teller.Tell(pipe_.out.get(), request, 1)
                     .then([this] { pipe_.out = nullptr; })
                     .eagerlyEvaluate(nullptr);
  ExpectTold(": veduta\n\nid: 1\nevent: journal\ndata: {\"sequence\":1,");
  EXPECT_EQ(told_.find("second"), std::string::npos);
  ASSERT_OK(engine_->AddCamera("second", StreetCameraModel(), "the truth"));
  ExpectTold("second");
  EXPECT_EQ(told_.find("id: 1\n"), told_.rfind("id: 1\n")) << "each entry once";
  is_stopping_ = true;
  telling.wait(io_.waitScope);
}

TEST(EventTeller, GoesOnAfterTheLastEventThatTheClientHas) {
  HttpRequest request;
  EXPECT_EQ(*FirstEvent(request, ""), 1u);
  request.query["from"] = "7";
  EXPECT_EQ(*FirstEvent(request, ""), 7u);
  EXPECT_EQ(*FirstEvent(request, "4"), 5u) << "what a browser has counts more than the address";
  EXPECT_EQ(*FirstEvent(request, "18446744073709551615"), UINT64_MAX);
  for (const char* wrong : {"-1", "x", "5x", "18446744073709551616"}) {
    EXPECT_EQ(FirstEvent(request, wrong).status().code(), StatusCode::kInvalidArgument) << wrong;
  }
}

}  // namespace
}  // namespace veduta
