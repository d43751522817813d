// SPDX-License-Identifier: Apache-2.0
// Goal: a pose, or a list of observations, comes back as it was stored; one that breaks a rule is
//   not encoded, and a damaged value is kCorruption.
// Method: round trips of full, empty and extreme records at every alignment; one rule broken at
//   a time; values flipped, cut, extended and replaced at seeded places.
#include "storage/records/pose_record.h"

#include <gtest/gtest.h>

#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

TEST(PoseRecord, RoundTrips) {
  SeededRandom random(1);
  const PoseRecord pose{ImageId(4), ReconstructionId(2), SampleRigid(&random)};
  PoseRecord decoded;
  RoundTrip(pose, &decoded, pose.image);
  EXPECT_EQ(decoded.image, pose.image);
  EXPECT_EQ(decoded.reconstruction, pose.reconstruction);
  EXPECT_EQ(decoded.cam_from_world.rotation.coeffs(), pose.cam_from_world.rotation.coeffs());
  EXPECT_EQ(decoded.cam_from_world.translation, pose.cam_from_world.translation);

  const std::vector<Observation> rows = {
      {0, {ImageId(1), 1}}, {5, {ImageId(kMax), kMax}}, {kMax, {ImageId(2), 3}}};
  for (size_t count = 0; count <= rows.size(); ++count) {
    const std::span<const Observation> some(rows.data(), count);
    const Result<std::string> value = Encode(some);
    ASSERT_OK(value);
    std::vector<Observation> read;
    ASSERT_OK(Decode(*value, &read));
    EXPECT_EQ(read, std::vector<Observation>(some.begin(), some.end()));
  }
}

TEST(PoseRecord, RefusesWhatBreaksARule) {
  PoseRecord pose{ImageId(1), ReconstructionId(1), Rigid3()};
  pose.cam_from_world.translation.y() = kNan;
  ExpectRefused(pose, "translation");
  pose.cam_from_world = Rigid3();
  pose.cam_from_world.rotation.coeffs() *= 1.1;
  ExpectRefused(pose, "rotation");

  std::vector<Observation> rows = {{5, {ImageId(1), 1}}, {5, {ImageId(2), 1}}};
  ExpectRefused(std::span<const Observation>(rows), "ascending");
  rows[1] = {6, {ImageId(2), 0}};
  ExpectRefused(std::span<const Observation>(rows), "ordinal");
}

TEST(PoseRecord, DamagedValueIsCorruption) {
  SeededRandom random(1);
  Fuzz(PoseRecord{ImageId(4), ReconstructionId(2), SampleRigid(&random)}, ImageId(4));
  Fuzz(std::vector<Observation>{{1, {ImageId(1), 1}}, {2, {ImageId(2), 2}}});
}

}  // namespace
}  // namespace veduta
