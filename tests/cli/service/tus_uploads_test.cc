// SPDX-License-Identifier: Apache-2.0
// Goal: the protocol's answers where a whole daemon takes long to get there: limits, an upload that
//   has expired, a line that is full or closing, tokens.
// Method: requests as the connections hand them over, to an engine with small limits; tus_test.py
//   has the rest.
#include "cli/service/tus_uploads.h"

#include <gtest/gtest.h>

#include "cli/service/tus_message.h"
#include "tests/engine/street_fixture.h"
#include "tests/option_bounds.h"

namespace veduta {
namespace {

class TusUploadsTest : public testing::Test {
 protected:
  static TusOptions Small() {
    TusOptions options;
    options.limits.count_each_max = 2;
    options.length_bytes_max = 1'000'000;
    options.keep_s = 1'000;
    return options;
  }

  HttpAnswer Ask(const std::string& method, const std::string& id, HttpRequest request = {}) {
    request.method = method;
    request.path = {"v1", "tus"};
    if (!id.empty()) request.path.push_back(id);
    request.headers["Tus-Resumable"] = kTusVersion;
    return tus_.Answer(&city_.engine(), request);
  }
  HttpAnswer Begin(uint64_t length, uint32_t token = 0) {
    HttpRequest request;
    request.headers["Upload-Length"] = std::to_string(length);
    // 1.jpg by the camera "street": what is no photo has its turn where that is known, too.
    request.headers["Upload-Metadata"] = "filename MS5qcGc=,camera c3RyZWV0";
    request.token_number = token;
    return Ask("POST", "", std::move(request));
  }
  HttpAnswer Send(const std::string& id, uint64_t offset, std::vector<uint8_t> bytes,
                  uint32_t token = 0) {
    HttpRequest request;
    request.content_type = kTusContentType;
    request.headers["Upload-Offset"] = std::to_string(offset);
    request.body = std::move(bytes);
    request.token_number = token;
    return Ask("PATCH", id, std::move(request));
  }
  static std::string IdIn(const HttpAnswer& answer) {
    EXPECT_EQ(answer.code, 201u) << answer.body;
    const std::string where = HeaderOf(answer, "Location");
    return where.substr(where.rfind('/') + 1);
  }

  PhotoIntake intake_{{.photos_max = 2},
                      [](uint64_t, const std::string&, const Result<AddOutcome>&) {}};
  Quotas quotas_{TokenQuota{1'000, 1'000'000'000, 1'000}, Quotas::World{}};
  TusUploads tus_{Small(), &intake_, &quotas_};
  City city_;
};

TEST_F(TusUploadsTest, NobodyHasMoreOnTheWayThanMayBe) {
  EXPECT_EQ(Begin(1'000'001).code, 413u);
  const std::string first = IdIn(Begin(1'000, 7));
  IdIn(Begin(1'000, 7));
  const HttpAnswer full = Begin(1'000, 7);
  EXPECT_EQ(full.code, 429u);
  EXPECT_NE(HeaderOf(full, "Retry-After"), "");
  IdIn(Begin(1'000, 8));
  HttpRequest mine;
  mine.token_number = 7;
  EXPECT_EQ(Ask("DELETE", first, mine).code, 204u);
  IdIn(Begin(1'000, 7));
}

// What was announced and given up is free again, and what was sent is not.
TEST_F(TusUploadsTest, WhatIsGivenUpCountsInNoQuota) {
  HttpRequest mine;
  mine.token_number = 7;
  mine.quota = {2, 5'000, 0};
  const auto begin = [&](uint64_t length) {
    HttpRequest request = mine;
    request.headers["Upload-Length"] = std::to_string(length);
    request.headers["Upload-Metadata"] = "filename MS5qcGc=,camera c3RyZWV0";
    return Ask("POST", "", std::move(request));
  };
  for (int i = 0; i < 5; ++i) {
    const std::string id = IdIn(begin(4'000));
    EXPECT_EQ(begin(4'000).code, 429u) << "the bytes are used up";
    EXPECT_EQ(Send(id, 0, {1}, 7).code, 204u);
    EXPECT_EQ(Ask("DELETE", id, mine).code, 204u);
    EXPECT_EQ(Ask("DELETE", id, mine).code, 404u) << "once";
  }
  const std::string sent = IdIn(begin(10));
  EXPECT_EQ(Send(sent, 0, std::vector<uint8_t>(10, 1), 7).code, 204u);
  EXPECT_EQ(Ask("DELETE", sent, mine).code, 204u);
  while (intake_.counts().waiting > 0) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  IdIn(begin(10));
  EXPECT_EQ(begin(10).code, 429u) << "the photo that is in line counts";
}

TEST_F(TusUploadsTest, AnUploadIsItsTokensOwn) {
  const std::string id = IdIn(Begin(1'000, 7));
  for (const uint32_t other : {0u, 8u}) EXPECT_EQ(Send(id, 0, {1}, other).code, 404u);
  EXPECT_EQ(Send(id, 0, {1}, 7).code, 204u);
  HttpRequest owner;
  owner.is_of_owner = true;
  EXPECT_EQ(HeaderOf(Ask("GET", id, owner), "Upload-Offset"), "1");
}

TEST_F(TusUploadsTest, WhatHasExpiredIsGone) {
  const std::string id = IdIn(Begin(1'000));
  TusOptions brief = Small();
  brief.keep_s = 1;
  TusUploads later(brief, &intake_, &quotas_);
  HttpRequest request;
  request.method = "GET";
  request.path = {"v1", "tus", id};
  while (later.Answer(&city_.engine(), request).code == 200)
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(later.Answer(&city_.engine(), request).code, 410u);
  std::this_thread::sleep_for(std::chrono::milliseconds(1'100));
  ASSERT_OK(later.Expire(&city_.engine()));
  EXPECT_EQ(later.Answer(&city_.engine(), request).code, 404u);
}

// Whoever has announced a photo in time is not sent away with its last byte.
TEST_F(TusUploadsTest, AFullLineRefusesAnnouncements) {
  std::optional<Writer::Turn> turn = city_.parts().writer->Take();
  const std::string ids[] = {IdIn(Begin(10, 1)), IdIn(Begin(10, 2)), IdIn(Begin(10, 3))};
  for (uint8_t i = 0; i < 3; ++i)
    EXPECT_EQ(Send(ids[i], 0, std::vector<uint8_t>(10, i), i + 1u).code, 204u);
  EXPECT_EQ(intake_.counts().waiting, 3u);
  const HttpAnswer full = Begin(10, 4);
  EXPECT_EQ(full.code, 429u);
  EXPECT_NE(HeaderOf(full, "Retry-After"), "");
  // The last part once more changes nothing.
  EXPECT_EQ(Send(ids[0], 0, std::vector<uint8_t>(10, 0), 1).code, 409u);
  EXPECT_EQ(Send(ids[0], 10, {}, 1).code, 204u);
  EXPECT_EQ(intake_.counts().waiting, 3u);
  intake_.Close();
  EXPECT_EQ(Begin(10, 5).code, 503u);
  turn.reset();
  city_.Close();
}

TEST_F(TusUploadsTest, AClosingDaemonKeepsWhatHasCome) {
  const std::string id = IdIn(Begin(10));
  intake_.Close();
  EXPECT_EQ(Send(id, 0, {1, 2}).code, 204u);
  EXPECT_EQ(Send(id, 2, std::vector<uint8_t>(8)).code, 503u) << "the next daemon takes the last";
  EXPECT_EQ(HeaderOf(Ask("GET", id), "Upload-Offset"), "2");
}

TEST(TusOptions, HaveBounds) {
  ExpectBounds<TusOptions>(&TusOptions::keep_s, "keep_s", {0u, 31'536'001u}, {1u, 31'536'000u});
  TusOptions options;
  options.length_bytes_max = 0;
  EXPECT_EQ(options.Check().code(), StatusCode::kInvalidArgument);
  options = {};
  options.limits.count_max = 0;
  EXPECT_EQ(options.Check().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace veduta
