// SPDX-License-Identifier: Apache-2.0
// Goal: rules that records share refuse what breaks them, and numbers read back.
// Method: values on both sides of each rule.
#include "storage/records/record_parts.h"

#include <gtest/gtest.h>

#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

TEST(RecordParts, NumbersAreLittleEndianAndExact) {
  EXPECT_EQ(EncodeU32(0x01020304), std::string("\4\3\2\1"));
  uint32_t number = 0;
  ASSERT_OK(DecodeU32(EncodeU32(kMax), &number));
  EXPECT_EQ(number, kMax);
  EXPECT_EQ(DecodeU32("abcde", &number).code(), StatusCode::kCorruption);
  EXPECT_EQ(DecodeU32("", &number).code(), StatusCode::kCorruption);
}

TEST(RecordParts, RotationsHaveUnitLength) {
  Rigid3 pose;
  EXPECT_OK(CheckTransform(pose.rotation, pose.translation));
  pose.rotation.coeffs() *= 1.0005;
  EXPECT_OK(CheckTransform(pose.rotation, pose.translation));
  pose.rotation.coeffs() *= 1.001;
  EXPECT_FALSE(IsRigid(pose.rotation, pose.translation));
  EXPECT_FALSE(CheckTransform(pose.rotation, pose.translation).ok());
  pose = Rigid3();
  pose.translation.y() = kNan;
  const Status status = CheckTransform(pose.rotation, pose.translation);
  EXPECT_NE(status.message().find("translation"), std::string::npos) << status.message();
}

TEST(RecordParts, DamageKeepsTheReason) {
  EXPECT_OK(Damaged(Status::Ok()));
  const Status damaged = Damaged(Broken("fx", 3, "4"));
  EXPECT_EQ(damaged.code(), StatusCode::kCorruption);
  EXPECT_EQ(damaged.message(), "fx is 3, but must be 4");
  EXPECT_EQ(CheckFinite({{"a", 1}, {"b", kNan}}).code(), StatusCode::kInvalidArgument);
  const std::vector<int> rows = {1, 2, 2};
  EXPECT_FALSE(StrictlyAscending(std::span<const int>(rows), std::less<>()));
  EXPECT_TRUE(StrictlyAscending(std::span<const int>(rows).first(2), std::less<>()));
}

}  // namespace
}  // namespace veduta
