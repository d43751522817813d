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

  Quotas::Clock::time_point now_{};
  Quotas quotas_{TokenQuota{24, 24'000, 2}, [this] { return now_; }};
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
}

}  // namespace
}  // namespace veduta
