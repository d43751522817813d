// SPDX-License-Identifier: Apache-2.0
// Goal: requests are answered from any thread, once each, until the service has gone; events go on
//   from where they are asked for; a closing service is alive and not ready; while the files are
//   opened again, questions wait; who waits for the writer's turn, and commands, hold up no others.
// Method: a database of the test's own, requests as the connections hand them over.
#include "cli/service/city_service.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <future>
#include <map>
#include <mutex>
#include <stop_token>
#include <thread>

#include "engine/parts.h"
#include "tests/engine/street_fixture.h"
#include "tests/option_bounds.h"

namespace veduta {
namespace {

// A service of a database that holds one camera.
class CityServiceTest : public testing::Test {
 protected:
  CityServiceTest() {
    city_.Close();
    auto engine = Engine::Open(city_.path());
    EXPECT_OK(engine);
    engine_ = engine->get();
    service_ = std::make_unique<CityService>(*std::move(engine), city_.path(), options_,
                                             CityService::Listeners());
  }

  HttpAnswer Ask(const std::string& method, std::vector<std::string> path,
                 const std::string& tag = "") {
    HttpRequest request;
    request.method = method;
    request.path = std::move(path);
    request.if_none_match = tag;
    std::promise<HttpAnswer> answer;
    service_->Handle(request, [&](HttpAnswer a) { answer.set_value(std::move(a)); });
    return answer.get_future().get();
  }

  // The code of the answer to the owner; 0 where it takes long.
  uint32_t AskSoon(const std::string& method, std::vector<std::string> path,
                   const std::string& body = "") {
    HttpRequest request;
    request.method = method;
    request.path = std::move(path);
    request.is_of_owner = true;
    request.body.assign(body.begin(), body.end());
    const auto code = std::make_shared<std::promise<uint32_t>>();  // it may be answered later
    service_->Handle(request, [code](const HttpAnswer& answer) { code->set_value(answer.code); });
    std::future<uint32_t> told = code->get_future();
    return told.wait_for(std::chrono::seconds(20)) == std::future_status::ready ? told.get() : 0;
  }

  CityEvents EventsFrom(uint64_t first) {
    std::promise<Result<CityEvents>> told;
    service_->TellEvents(first, {}, [&](Result<CityEvents> e) { told.set_value(std::move(e)); });
    const Result<CityEvents> events = told.get_future().get();
    EXPECT_OK(events);
    return events.ok() ? *events : CityEvents();
  }

  City city_;
  ServiceOptions options_;
  Engine* engine_ = nullptr;  // the service's
  std::unique_ptr<CityService> service_;
};

TEST_F(CityServiceTest, AnAnswerHasTheTagOfItsSnapshot) {
  const HttpAnswer first = Ask("GET", {"v1", "cameras"});
  EXPECT_EQ(first.code, 200u);
  ASSERT_EQ(first.headers.size(), 1u);
  EXPECT_EQ(first.headers[0].first, "ETag");
  const HttpAnswer known = Ask("GET", {"v1", "cameras"}, first.headers[0].second);
  EXPECT_EQ(known.code, 304u);
  EXPECT_TRUE(known.body.empty());
  EXPECT_TRUE(Ask("GET", {"v1", "cameras", "none"}).headers.empty()) << "a failure has none";
}

TEST_F(CityServiceTest, EventsGoOnFromWhereTheyAreAskedFor) {
  const CityEvents all = EventsFrom(0);
  EXPECT_TRUE(all.text.starts_with("id: 1\nevent: journal\ndata: {\"sequence\":1,")) << all.text;
  EXPECT_TRUE(all.text.ends_with("}\n\n"));
  const CityEvents none = EventsFrom(all.next);
  EXPECT_EQ(none.text, "");
  EXPECT_EQ(none.next, all.next);
}

TEST_F(CityServiceTest, AClosingServiceIsAliveAndNotReady) {
  EXPECT_EQ(Ask("GET", {"readyz"}).code, 200u);
  service_->Close();
  EXPECT_EQ(Ask("GET", {"readyz"}).code, 503u);
  EXPECT_EQ(Ask("GET", {"healthz"}).code, 200u);
  EXPECT_EQ(Ask("GET", {"v1", "photos", "none", "neighbors"}).code, 404u);
  EXPECT_EQ(Ask("GET", {"v1", "status"}).code, 503u) << "it would have to wait";
}

TEST_F(CityServiceTest, QuestionsAreAnsweredWhileTheFilesAreOpenedAgain) {
  std::jthread reopening([&](std::stop_token stop) {
    while (!stop.stop_requested()) {
      EXPECT_OK(engine_->Reopen());
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  });
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(Ask("GET", {"v1", "cameras", "street"}).code, 200u) << i;
    EXPECT_EQ(Ask("GET", {"v1", "photos", "none", "neighbors"}).code, 404u) << i << ", a quick one";
    EXPECT_EQ(Ask("GET", {"v1", "reconstructions"}).code, 200u) << i;
  }
}

TEST_F(CityServiceTest, MetricsCountAnswers) {
  Ask("GET", {"v1", "none"});
  Ask("GET", {"v1", "none"});
  const HttpAnswer answer = Ask("GET", {"metrics"});
  EXPECT_NE(answer.body.find("veduta_http_requests_total{code=\"404\"} 2\n"), std::string::npos)
      << answer.body;
  EXPECT_NE(answer.body.find("veduta_images{verdict=\"placed\"} 0\n"), std::string::npos);
}

TEST_F(CityServiceTest, EveryRequestIsAnsweredBeforeTheServiceHasGone) {
  std::atomic<size_t> answered = 0;
  constexpr size_t kCount = 200;
  HttpRequest status;
  status.method = "GET";
  status.path = {"v1", "status"};
  HttpRequest photo;
  photo.method = "POST";
  photo.path = {"v1", "photos"};
  photo.query = {{"name", "a.jpg"}, {"camera", "street"}};
  photo.content_type = "image/jpeg";
  photo.body = {1, 2, 3};
  for (size_t i = 0; i < kCount; ++i)
    service_->Handle(i % 2 == 0 ? status : photo, [&](HttpAnswer) { ++answered; });
  service_.reset();
  EXPECT_EQ(answered, kCount);
}

TEST_F(CityServiceTest, ThirdCommandsAreSentAway) {
  HttpRequest settle;
  settle.method = "POST";
  settle.path = {"v1", "settle"};
  settle.is_of_owner = true;
  settle.body = {'{', '}'};
  std::atomic<size_t> done = 0, sent_away = 0;
  constexpr size_t kCount = 200;
  const auto ask = [&] {
    service_->Handle(settle, [&](const HttpAnswer& answer) {
      EXPECT_TRUE(answer.code == 200 || answer.code == 503) << answer.body;
      ++(answer.code == 200 ? done : sent_away);
    });
  };
  for (size_t i = 0; i < kCount; ++i) ask();
  while (done + sent_away < kCount) std::this_thread::yield();
  EXPECT_GE(done, 2u);
  EXPECT_GT(sent_away, 0u);
  done = sent_away = 0;
  ask();  // the places of those before were given back
  while (done + sent_away == 0) std::this_thread::yield();
  EXPECT_EQ(done, 1u);
}

// Of those who write while somebody else holds the writer's turn.
TEST_F(CityServiceTest, ChangesThatWaitForTheWriterHoldNobodyElseUp) {
  std::atomic<size_t> opened = 0;
  constexpr size_t kCount = 20;
  HttpRequest contribution;
  contribution.method = "POST";
  contribution.path = {"v1", "contributions"};
  contribution.content_type = "application/json";
  contribution.body = {'{', '}'};
  contribution.may_name_others = true;
  {
    const Writer::Turn turn = EngineParts::Of(*engine_).writer->Take();
    for (size_t i = 0; i < kCount; ++i) {
      service_->Handle(contribution, [&](const HttpAnswer& answer) {
        EXPECT_EQ(answer.code, 201u) << answer.body;
        ++opened;
      });
    }
    EXPECT_EQ(AskSoon("GET", {"v1", "status"}), 200u);
    EXPECT_EQ(AskSoon("GET", {"v1", "journal"}), 200u);
    EXPECT_EQ(opened, 0u);
  }
  while (opened < kCount) std::this_thread::yield();
}

TEST_F(CityServiceTest, RemovalsAreTakenWhileTwoCommandsAreAtWork) {
  HttpRequest command;
  command.method = "POST";
  command.path = {"v1", "georeference"};
  command.query = {{"forget", "yes"}};
  command.is_of_owner = true;
  std::atomic<size_t> ended = 0;
  {
    const Writer::Turn turn = EngineParts::Of(*engine_).writer->Take();
    for (size_t i = 0; i < 2; ++i) service_->Handle(command, [&](const HttpAnswer&) { ++ended; });
    EXPECT_EQ(AskSoon("POST", {"v1", "georeference"}), 503u) << "two are at work";
    EXPECT_EQ(AskSoon("POST", {"v1", "removals"}, R"({"photos": ["none.jpg"], "actor": "kai"})"),
              404u);
    EXPECT_EQ(AskSoon("DELETE", {"v1", "contributions", "7"}), 404u);
  }
  while (ended < 2) std::this_thread::yield();
}

TEST_F(CityServiceTest, TooManyOfOneAreToldToComeAgain) {
  options_.waiting_of_one_max = 1;
  options_.query_threads = 1;
  service_.reset();
  auto engine = Engine::Open(city_.path());
  ASSERT_OK(engine);
  service_ = std::make_unique<CityService>(*std::move(engine), city_.path(), options_,
                                           CityService::Listeners());
  HttpRequest status;
  status.method = "GET";
  status.path = {"v1", "status"};
  status.address = "192.0.2.1";
  std::mutex mutex;
  std::map<uint32_t, size_t> codes;
  for (size_t i = 0; i < 200; ++i) {
    service_->Handle(status, [&](const HttpAnswer& answer) {
      const std::lock_guard lock(mutex);
      ++codes[answer.code];
      if (answer.code == 429) {
        EXPECT_EQ(HeaderOf(answer, "Retry-After"), "1");
      }
    });
  }
  const auto count_of = [&](uint32_t code) {
    const std::lock_guard lock(mutex);
    return codes[code];
  };
  while (count_of(200) == 0) std::this_thread::yield();  // its turn has come
  service_.reset();
  EXPECT_GT(codes[429], 0u);
  EXPECT_EQ(codes[200] + codes[429] + codes[503], 200u) << "503: those that waited at the end";
}

TEST(ServiceOptions, HaveBounds) {
  ExpectBounds(&ServiceOptions::waiting_of_one_max, "waiting_of_one_max", {0u, 100'001u},
               {1u, 100'000u});
  ExpectBounds(&ServiceOptions::long_threads, "long_threads", {0u, 1025u}, {1u, 1024u});
  ExpectBounds(&ServiceOptions::waiting_questions_max, "waiting_questions_max", {0u, 100'001u},
               {1u, 100'000u});
  ExpectBounds(&ServiceOptions::settle_pause_s, "settle_pause_s", {0u, 86'401u}, {1u, 86'400u});
  ExpectBounds(&ServiceOptions::query_threads, "query_threads", {0u, 1025u}, {1u, 1024u});
}

}  // namespace
}  // namespace veduta
