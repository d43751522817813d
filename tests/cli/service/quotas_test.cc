// SPDX-License-Identifier: Apache-2.0
// Goal: a token does as much as its quota says, told by 429 and the time after which there is more;
//   one token's use is not another's.
// Method: a clock of the test's own.
#include "cli/service/quotas.h"

#include <gtest/gtest.h>

namespace veduta {
namespace {

HttpRequest Of(uint32_t token, TokenQuota quota = {}) {
  HttpRequest request;
  request.token_number = token;
  request.quota = quota;
  return request;
}

class QuotasTest : public testing::Test {
 protected:
  void Pass(double seconds) {
    now_ +=
        std::chrono::duration_cast<Quotas::Clock::duration>(std::chrono::duration<double>(seconds));
  }
  // 0: there was enough; otherwise Retry-After.
  static int Wait(const std::optional<HttpAnswer>& refusal) {
    if (!refusal) return 0;
    EXPECT_EQ(refusal->code, 429u);
    return std::stoi(HeaderOf(*refusal, "Retry-After"));
  }

  Quotas::World World() {
    return {.now = [this] { return now_; },
            .unix_ms = [this] { return unix_ms_; },
            .keep = [this](const TokenUse& use) { kept_[use.token] = use; }};
  }
  std::vector<TokenUse> Kept() const {
    std::vector<TokenUse> uses;
    for (const auto& [token, use] : kept_) uses.push_back(use);
    return uses;
  }

  Quotas::Clock::time_point now_{};
  int64_t unix_ms_ = 1'000'000;
  std::map<uint32_t, TokenUse> kept_;
  Quotas quotas_{TokenQuota{24, 24'000, 2}, World()};
};

TEST_F(QuotasTest, RequestsFillAgain) {
  for (int i = 0; i < 20; ++i) EXPECT_EQ(Wait(quotas_.TakeRequest(Of(1))), 0) << i;
  EXPECT_EQ(Wait(quotas_.TakeRequest(Of(1))), 1);
  EXPECT_EQ(Wait(quotas_.TakeRequest(Of(2))), 0) << "another token";
  Pass(1);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(Wait(quotas_.TakeRequest(Of(1))), 0);
  EXPECT_EQ(Wait(quotas_.TakeRequest(Of(1))), 1);
  Pass(1'000);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(Wait(quotas_.TakeRequest(Of(1))), 0);
  EXPECT_EQ(Wait(quotas_.TakeRequest(Of(1))), 1) << "no more than the burst";
}

TEST_F(QuotasTest, PhotosAndBytesADay) {
  for (int i = 0; i < 24; ++i) EXPECT_EQ(Wait(quotas_.TakePhoto(Of(1), 10)), 0);
  EXPECT_EQ(Wait(quotas_.TakePhoto(Of(1), 10)), 3'600);
  Pass(3'600.1);
  EXPECT_EQ(Wait(quotas_.TakePhoto(Of(1), 10)), 0);
  EXPECT_EQ(Wait(quotas_.TakePhoto(Of(2), 23'000)), 0);
  EXPECT_EQ(Wait(quotas_.TakePhoto(Of(2), 2'000)), 3'600);
  EXPECT_EQ(Wait(quotas_.TakePhoto(Of(2), 1'000)), 0);
  quotas_.GivePhoto(Of(2), 1'000);
  EXPECT_EQ(Wait(quotas_.TakePhoto(Of(2), 1'000)), 0) << "it was given back";
  EXPECT_EQ(Wait(quotas_.TakePhoto(Of(2), 1)), 4);
  EXPECT_EQ(Wait(quotas_.TakePhoto(Of(3), 1'000'000)), 86'400) << "more than there ever is";
}

TEST_F(QuotasTest, WhatIsGivenUpLaterIsGivenBackAsFarAsTheDayHasNotDoneIt) {
  for (const double after_s : {0.0, 21'600.0, 43'200.0, 86'400.0, 1e6}) {
    const auto token = static_cast<uint32_t>(1 + after_s);
    EXPECT_EQ(Wait(quotas_.TakePhoto(Of(token), 24'000)), 0);
    Pass(after_s);
    quotas_.GivePhoto(Of(token), 24'000, after_s);
    EXPECT_EQ(Wait(quotas_.TakePhoto(Of(token), 24'000)), 0) << "all is free after " << after_s;
    EXPECT_NE(Wait(quotas_.TakePhoto(Of(token), 1)), 0) << "and no more than all";
  }
  EXPECT_EQ(Wait(quotas_.TakePhoto(Of(2), 24'000)), 0);
  quotas_.GivePhoto(Of(2), 24'000, 43'200);
  EXPECT_NE(Wait(quotas_.TakePhoto(Of(2), 12'001)), 0) << "the other half has filled, or will";
}

TEST_F(QuotasTest, ContributionsADay) {
  for (int i = 0; i < 1'000; ++i) EXPECT_EQ(Wait(quotas_.TakeContribution(Of(1))), 0) << i;
  EXPECT_EQ(Wait(quotas_.TakeContribution(Of(1))), 87);
  EXPECT_EQ(Wait(quotas_.TakeContribution(Of(2))), 0) << "another token";
  EXPECT_EQ(Wait(quotas_.TakePhoto(Of(1), 10)), 0) << "photos are counted apart";
  Pass(86.5);
  EXPECT_EQ(Wait(quotas_.TakeContribution(Of(1))), 0);
  EXPECT_NE(Wait(quotas_.TakeContribution(Of(1))), 0);
  EXPECT_NEAR(kept_.at(1).contributions, 1'000, 0.01) << "they outlive the daemon";
  Quotas anew(TokenQuota{24, 24'000, 2}, World());
  anew.Restore(Kept());
  EXPECT_NE(Wait(anew.TakeContribution(Of(1))), 0);
}

TEST_F(QuotasTest, ATokensOwnQuotaCounts) {
  EXPECT_EQ(Wait(quotas_.TakePhoto(Of(1, {1, 0, 0}), 10)), 0);
  EXPECT_EQ(Wait(quotas_.TakePhoto(Of(1, {1, 0, 0}), 10)), 86'400);
  EXPECT_EQ(Wait(quotas_.TakePhoto(Of(2, {0, 100, 0}), 101)), 864);
  for (int i = 0; i < 1'000; ++i) EXPECT_EQ(Wait(quotas_.TakeRequest(Of(3, {0, 0, 100}))), 0);
  EXPECT_NE(Wait(quotas_.TakeRequest(Of(3, {0, 0, 100}))), 0);
}

TEST_F(QuotasTest, TheOwnerHasNone) {
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(Wait(quotas_.TakeRequest(Of(0))), 0);
    EXPECT_EQ(Wait(quotas_.TakePhoto(Of(0), 1'000'000'000)), 0);
  }
  for (int i = 0; i < 1'001; ++i) {
    EXPECT_EQ(Wait(quotas_.TakeContribution(Of(0))), 0);
  }
}

TEST_F(QuotasTest, ReportsAreCountedOfAllWhoComeWithoutATokenTogether) {
  for (const uint32_t token : {0, 7}) {
    for (int i = 0; i < 100; ++i) EXPECT_EQ(Wait(quotas_.TakeReport(Of(token))), 0);
    EXPECT_EQ(Wait(quotas_.TakeReport(Of(token))), 864);
  }
  HttpRequest owner = Of(0);
  owner.is_of_owner = true;
  EXPECT_EQ(Wait(quotas_.TakeReport(owner)), 0);
}

TEST_F(QuotasTest, ReportsAreCountedByTheirAddress) {
  const auto from = [&](uint32_t token, const std::string& address) {
    HttpRequest request = Of(token);
    request.address = address;
    return Wait(quotas_.TakeReport(request));
  };
  for (uint32_t i = 0; i < 200; ++i)
    EXPECT_EQ(from(1 + i, "2001:db8::" + std::to_string(i)), 0) << i;
  EXPECT_EQ(from(1'000, "2001:db8::beef"), 432) << "a new token and the same network";
  EXPECT_EQ(from(1'000, "2001:db8:0:1::"), 0) << "another network";
  now_ += std::chrono::seconds(432);
  EXPECT_EQ(from(1'001, "2001:db8::1"), 0);
  EXPECT_EQ(from(1'001, "2001:db8::1"), 432);
  // However many addresses come, the one that has used up its reports is not forgotten.
  for (uint32_t i = 0; i < 11'000; ++i)
    EXPECT_EQ(from(2'000 + i, "10.0.0." + std::to_string(i)), 0);
  EXPECT_EQ(from(1'001, "2001:db8::1"), 432);
}

// A daemon that begins anew goes on with what was used, and with the time that has passed.
TEST_F(QuotasTest, OutliveTheDaemon) {
  for (int i = 0; i < 24; ++i) EXPECT_EQ(Wait(quotas_.TakePhoto(Of(1), 10)), 0);
  EXPECT_EQ(Wait(quotas_.TakePhoto(Of(2), 20'000)), 0);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(Wait(quotas_.TakeReport(Of(0))), 0);
  ASSERT_EQ(kept_.size(), 3u);
  EXPECT_EQ(kept_.at(1).photos, 24);
  EXPECT_EQ(kept_.at(1).bytes, 240);
  unix_ms_ += 1'800'000;  // half an hour: half a photo, 500 bytes, two reports
  Quotas anew(TokenQuota{24, 24'000, 2}, World());
  anew.Restore(Kept());
  EXPECT_EQ(Wait(anew.TakePhoto(Of(1), 10)), 1'800);
  EXPECT_EQ(Wait(anew.TakePhoto(Of(2), 5'000)), 1'800);
  EXPECT_EQ(Wait(anew.TakePhoto(Of(2), 4'500)), 0);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(Wait(anew.TakeReport(Of(0))), 0);
  EXPECT_NE(Wait(anew.TakeReport(Of(0))), 0);
  EXPECT_EQ(Wait(anew.TakePhoto(Of(3), 10)), 0) << "one that nothing is known of";
  unix_ms_ -= 7'200'000;  // a clock that was put back fills nothing
  Quotas again(TokenQuota{24, 24'000, 2}, World());
  again.Restore(Kept());
  EXPECT_NE(Wait(again.TakePhoto(Of(1), 10)), 0);
}

}  // namespace
}  // namespace veduta
