// SPDX-License-Identifier: Apache-2.0
// Goal: a client asks the daemon of a database and sends it photos, by the owner's socket; where
//   the daemon has gone it says so.
// Method: a daemon on a thread, over a database of the test's own.
#include "cli/service/daemon_client.h"

#include <gtest/gtest.h>

#include <future>
#include <thread>

#include "cli/service/http_door.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

class DaemonClientTest : public testing::Test {
 protected:
  DaemonClientTest() {
    city_.Close();
    auto engine = Engine::Open(city_.path());
    EXPECT_OK(engine);
    service_ = std::make_unique<CityService>(*std::move(engine), city_.path(), ServiceOptions(),
                                             CityService::Listeners());
    HttpDoorOptions options;
    options.address = "127.0.0.1:0";
    options.database = city_.path();
    std::promise<void> listening;
    thread_ = std::jthread([this, options, &listening](std::stop_token stop) {
      EXPECT_OK(ServeHttp(service_.get(), options, stop,
                          [&](const std::string&) { listening.set_value(); }));
    });
    listening.get_future().wait();
  }

  void Stop() {
    thread_.request_stop();
    thread_.join();
  }

  City city_;
  std::unique_ptr<CityService> service_;
  std::jthread thread_;
};

TEST_F(DaemonClientTest, AsksAndSends) {
  auto client = DaemonClient::Connect(city_.path());
  ASSERT_TRUE(client);
  const auto cameras = client->Ask({"GET", "/v1/cameras/street", "", {}});
  ASSERT_OK(cameras);
  EXPECT_EQ(cameras->code, 200u);
  EXPECT_EQ(Json::parse(cameras->body)["name"], "street");
  const std::vector<uint8_t> jpeg = TakePhoto(Walk(6, 0.9, 1)[0]).jpeg;
  DaemonClient::Question photo{"POST", "/v1/photos?camera=street&name=" + EncodeForQuery("a b&c"),
                               "image/jpeg", jpeg};
  photo.prefers_async = true;
  const auto accepted = client->Ask(photo);
  ASSERT_OK(accepted);
  EXPECT_EQ(accepted->code, 202u) << accepted->body;
  EXPECT_EQ(HeaderOf(*accepted, "Location"), "/v1/uploads/1");
  EXPECT_EQ(HeaderOf(*accepted, "Retry-After"), "");
  EXPECT_EQ(Json::parse(accepted->body)["image"], "a b&c");
  const std::string remove = R"({"actor": "anna", "contributor": "nobody"})";
  const auto removed =
      client->Ask({"POST",
                   "/v1/removals",
                   "application/json",
                   {reinterpret_cast<const uint8_t*>(remove.data()), remove.size()}});
  ASSERT_OK(removed);
  EXPECT_EQ(removed->code, 404u) << removed->body << ": the owner may, and nobody is not there";
  client.reset();
  Stop();
}

TEST_F(DaemonClientTest, ADaemonThatHasGoneIsTold) {
  auto client = DaemonClient::Connect(city_.path());
  ASSERT_TRUE(client);
  Stop();
  EXPECT_EQ(client->Ask({"GET", "/v1/status", "", {}}).status().code(), StatusCode::kIoError);
  EXPECT_FALSE(DaemonClient::Connect(city_.path()));
}

TEST(DaemonClientText, NamesAreEncoded) {
  EXPECT_EQ(EncodeForQuery("a b/c&d=\xC3\xA9"), "a%20b%2Fc%26d%3D%C3%A9");
}

}  // namespace
}  // namespace veduta
