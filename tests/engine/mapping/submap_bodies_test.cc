// SPDX-License-Identifier: Apache-2.0
// Goal: submaps that stand elsewhere as one body are carried back whole, also where many ties are
//   wrong; where all stand right, and where only strain moved them a little, all stay; the same
//   bits come out at any number of threads.
// Method: submaps on a ring (submap_ring.h), some of them carried away.
#include "engine/mapping/submap_bodies.h"

#include <gtest/gtest.h>

#include "tests/engine/mapping/submap_ring.h"

namespace veduta {
namespace {

std::vector<Sim3> Carry(const Ring& ring, size_t threads = 0) {
  ThreadPool pool(threads);
  return CarryBodies(ring.problem, &pool);
}

Sim3 Away(double turn_rad) {
  return {1.02,
          Eigen::Quaterniond(Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitY())),
          {10 * turn_rad, 1, -20 * turn_rad}};
}

std::map<uint32_t, Sim3> Torn(const std::vector<uint32_t>& submaps, const Sim3& away) {
  std::map<uint32_t, Sim3> torn;
  for (const uint32_t submap : submaps) torn[submap] = away;
  return torn;
}

TEST(SubmapBodies, AreCarriedBack) {
  for (const double turn_rad : {0.02, 0.1, 0.4}) {
    SCOPED_TRACE("turned by " + std::to_string(turn_rad));
    const std::vector<std::vector<uint32_t>> bodies = {{2}, {5, 6, 7}, {0, 1, 2}};
    for (const std::vector<uint32_t>& body : bodies) {
      const Ring ring =
          MakeRing({.noise_px = 0.3, .wrong_share = 0.2, .torn = Torn(body, Away(turn_rad))});
      EXPECT_GT(WorstCenter(ring, std::vector<Sim3>(kSubmaps)), 0.5);
      const std::vector<Sim3> carried = Carry(ring);
      ASSERT_EQ(carried.size(), kSubmaps);
      EXPECT_LT(WorstCenter(ring, carried), 0.2);
    }
  }
}

TEST(SubmapBodies, TwoAreCarriedOneAfterTheOther) {
  std::map<uint32_t, Sim3> torn = Torn({4, 5}, Away(-0.3));
  torn[1] = Away(0.2);
  const Ring ring = MakeRing({.noise_px = 0.3, .torn = torn});
  EXPECT_GT(WorstCenter(ring, std::vector<Sim3>(kSubmaps)), 1);
  const std::vector<Sim3> carried = Carry(ring);
  ASSERT_EQ(carried.size(), kSubmaps);
  EXPECT_LT(WorstCenter(ring, carried), 0.2);
  EXPECT_EQ(carried[7].translation, Eigen::Vector3d::Zero()) << "it stood right";
}

TEST(SubmapBodies, StayWhereNothingSaysOtherwise) {
  EXPECT_TRUE(Carry(MakeRing({.noise_px = 0.5})).empty());
  EXPECT_TRUE(Carry(MakeRing({.noise_px = 0.5, .wrong_share = 0.3})).empty());
  RelaxationProblem none;
  none.centers.resize(3, Eigen::Vector3d::Zero());
  ThreadPool pool(0);
  EXPECT_TRUE(CarryBodies(none, &pool).empty());
}

TEST(SubmapBodies, RepeatBitForBitAtAnyNumberOfThreads) {
  const Ring ring =
      MakeRing({.noise_px = 0.3, .wrong_share = 0.2, .torn = Torn({4, 5}, Away(0.3))});
  const std::vector<Sim3> first = Carry(ring), second = Carry(ring, 3);
  ASSERT_EQ(first.size(), second.size());
  for (size_t i = 0; i < first.size(); ++i) EXPECT_EQ(first[i].translation, second[i].translation);
}

}  // namespace
}  // namespace veduta
