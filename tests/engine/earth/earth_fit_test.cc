// SPDX-License-Identifier: Apache-2.0
// Goal: the similarity to the earth is found from exact and from noisy places, along straight
//   streets too; wrong places do not move it; what it says of its errors is so.
// Method: seeded walks with a known similarity; errors of the stated size, shared by half within a
//   group; over many walks the error of a point beside what the covariance says of it.
#include "engine/earth/earth_fit.h"

#include <gtest/gtest.h>

#include <cmath>

#include "storage/base/content_hash.h"
#include "tests/engine/earth/level_cameras.h"

namespace veduta {
namespace {

using testing::HeldCamera;
using testing::Radians;

const Sim3 kTruth{7.5, Eigen::Quaterniond(0.4, 0.2, -0.6, 0.5).normalized(), {120, -40, 8}};

double Normal(SeededRandom* random) {
  const double radius = std::sqrt(-2 * std::log(1 - random->Unit()));
  return radius * std::cos(2 * std::numbers::pi * random->Unit());
}

struct Walk {
  std::vector<Rigid3> cams;
  std::vector<EarthAnchor> anchors;
};

// `count` photos along a street of 100 m, `bend_m` off the straight line in its middle. The common
// errors of groups are so many times as large as they say.
Walk MakeWalk(uint64_t seed, int count, double bend_m, double deviation_m, uint32_t groups,
              double common_times = 1) {
  SeededRandom random(seed);
  const Sim3 world_from_enu = kTruth.Inverse();
  std::vector<Eigen::Vector3d> common;
  for (uint32_t group = 0; group < groups; ++group)
    common.emplace_back(Normal(&random), Normal(&random), 2 * Normal(&random));
  Walk walk;
  for (int i = 0; i < count; ++i) {
    const double along = 100.0 * i / (count - 1);
    const Eigen::Vector3d enu(along, bend_m * std::sin(std::numbers::pi * along / 100), 1.6);
    const Rigid3 held =
        HeldCamera(enu, 360 * random.Unit(), 8 * Normal(&random), 2 * Normal(&random));
    walk.cams.push_back(TransformCameraWorld(world_from_enu, held));
    EarthAnchor anchor;
    anchor.world = world_from_enu * enu;
    anchor.deviation_m = deviation_m * Eigen::Vector3d(1, 1, 2);
    Eigen::Vector3d error(Normal(&random), Normal(&random), 2 * Normal(&random));
    if (groups > 0) {
      anchor.group = 1 + static_cast<uint32_t>(i) % groups;
      error = (error + common_times * common[anchor.group - 1]) / std::numbers::sqrt2;
    }
    anchor.enu_m = enu + deviation_m * error;
    walk.anchors.push_back(anchor);
  }
  return walk;
}

std::optional<EarthFit> Fit(const Walk& walk) {
  return FitEarth(walk.anchors, {}, FindUp(walk.cams));
}

double FarthestOff(const Sim3& fitted, const Walk& walk) {
  double off = 0;
  for (const EarthAnchor& anchor : walk.anchors)
    off = std::max(off, (fitted * anchor.world - kTruth * anchor.world).norm());
  return off;
}

TEST(FitEarth, FindsAnExactSimilarity) {
  Walk walk = MakeWalk(1, 20, 30, 1e-9, 0);
  for (EarthAnchor& anchor : walk.anchors) anchor.deviation_m.setConstant(0.01);
  const auto fit = Fit(walk);
  ASSERT_TRUE(fit);
  EXPECT_LT(FarthestOff(fit->enu_from_world, walk), 0.01);
  EXPECT_NEAR(fit->enu_from_world.scale, kTruth.scale, 1e-3);
  EXPECT_EQ(std::ranges::count(fit->agrees, true), 20);
  EXPECT_LT(fit->position_deviation_m, 0.02);
}

// Positions along a line say nothing of the rotation about it: how cameras are held does.
TEST(FitEarth, AStraightStreetStandsUpright) {
  const Walk walk = MakeWalk(2, 40, 0, 3, 1);
  const auto fit = Fit(walk);
  ASSERT_TRUE(fit);
  const Eigen::Vector3d up =
      fit->enu_from_world.rotation * (kTruth.rotation.conjugate() * Eigen::Vector3d::UnitZ());
  EXPECT_LT(std::acos(std::min(1.0, up.z())) / Radians(1), 4);
  EXPECT_LT(FarthestOff(fit->enu_from_world, walk), 15);
}

TEST(FitEarth, WrongPlacesDoNotMoveIt) {
  Walk walk = MakeWalk(3, 30, 20, 2, 0);
  const auto before = Fit(walk);
  ASSERT_TRUE(before);
  for (size_t i = 0; i < 9; ++i) walk.anchors[3 * i].enu_m += Eigen::Vector3d(400, -300, 0);
  const auto fit = Fit(walk);
  ASSERT_TRUE(fit);
  EXPECT_LT(FarthestOff(fit->enu_from_world, walk), FarthestOff(before->enu_from_world, walk) + 2);
  for (size_t i = 0; i < 30; ++i) EXPECT_EQ(fit->agrees[i], i % 3 != 0 || i >= 27) << i;
}

// One contributor of five whose receiver was 100 m off all the way.
TEST(FitEarth, AGroupThatIsFarOffDoesNotMoveIt) {
  Walk walk = MakeWalk(7, 60, 20, 4, 5);
  const auto before = Fit(walk);
  ASSERT_TRUE(before);
  for (size_t i = 0; i < 60; i += 5) walk.anchors[i].enu_m += Eigen::Vector3d(80, -60, 0);
  const auto fit = Fit(walk);
  ASSERT_TRUE(fit);
  EXPECT_LT(FarthestOff(fit->enu_from_world, walk), FarthestOff(before->enu_from_world, walk) + 3);
  for (size_t i = 0; i < 60; i += 5) EXPECT_FALSE(fit->agrees[i]) << i;
  EXPECT_GE(std::ranges::count(fit->agrees, true), 44);
  EXPECT_LT(fit->position_deviation_m, 2 * before->position_deviation_m);
}

// What heights are above is not told, and the sea lies tens of metres from the ellipsoid.
TEST(FitEarth, OpenHeightsDoNotBecomeSureByTheirNumber) {
  Walk walk = MakeWalk(8, 60, 20, 4, 5);
  for (EarthAnchor& anchor : walk.anchors) {
    anchor.has_open_height = true;
    anchor.enu_m.z() -= 47;
  }
  const auto fit = Fit(walk);
  ASSERT_TRUE(fit);
  EXPECT_GT(std::sqrt(fit->covariance(6, 6)), 25);
  EXPECT_LT(std::sqrt(fit->covariance(4, 4)), 5);
  // A few heights whose reference is known decide.
  for (size_t i = 0; i < 60; i += 7) {
    EarthAnchor known = walk.anchors[i];
    known.enu_m.z() += 47;
    known.deviation_m.setConstant(0.05);
    known.enu_m = kTruth * known.world;
    known.group = 0;
    known.has_open_height = false;
    walk.anchors.push_back(known);
  }
  const auto surveyed = Fit(walk);
  ASSERT_TRUE(surveyed);
  EXPECT_LT(FarthestOff(surveyed->enu_from_world, walk), 0.2);
  EXPECT_LT(std::sqrt(surveyed->covariance(6, 6)), 0.2);
}

TEST(FitEarth, SurveyedPointsOutweighGps) {
  Walk walk = MakeWalk(4, 30, 20, 6, 1);
  SeededRandom random(9);
  for (const Eigen::Vector3d& enu : {Eigen::Vector3d(0, 10, 0), Eigen::Vector3d(90, 14, 0),
                                     Eigen::Vector3d(50, -20, 3), Eigen::Vector3d(30, 18, 12)}) {
    EarthAnchor point;
    point.world = kTruth.Inverse() * enu;
    point.deviation_m.setConstant(0.02);
    point.enu_m = enu + 0.02 * Eigen::Vector3d(Normal(&random), Normal(&random), Normal(&random));
    walk.anchors.push_back(point);
  }
  const auto fit = Fit(walk);
  ASSERT_TRUE(fit);
  EXPECT_LT(FarthestOff(fit->enu_from_world, walk), 0.15);
  EXPECT_LT(fit->position_deviation_m, 0.1);
  EXPECT_LT(fit->tilt_deviation_deg, 0.5);
}

// A reconstruction is bent a little: that shows at the surveyed points, however well the many
// positions agree.
TEST(FitEarth, FewSurveyedPointsAnswerForThemselves) {
  const auto deviation_with = [](double bend_m) {
    Walk walk = MakeWalk(8, 60, 20, 6, 1);
    for (int i = 0; i < 6; ++i) {
      const Eigen::Vector3d enu(20.0 * i, i % 2 == 0 ? 8 : -8, 2 * (i % 3));
      EarthAnchor point;
      point.world = kTruth.Inverse() * enu;
      point.deviation_m.setConstant(0.02);
      point.enu_m = enu + Eigen::Vector3d(0, 0, bend_m * (i % 3 - 1));
      walk.anchors.push_back(point);
    }
    const auto fit = Fit(walk);
    EXPECT_TRUE(fit);
    return fit ? fit->position_deviation_m : 0;
  };
  EXPECT_GT(deviation_with(0.06), 1.3 * deviation_with(0));
}

// A drone looks straight down: cameras alone do not tell up from down, places do.
TEST(FitEarth, APlanFlownOverIsNotUpsideDown) {
  Walk walk = MakeWalk(5, 24, 40, 1, 0);
  walk.cams.clear();
  const Sim3 world_from_enu = kTruth.Inverse();
  for (size_t i = 0; i < walk.anchors.size(); ++i) {
    const Eigen::Vector3d enu = kTruth * walk.anchors[i].world;
    walk.cams.push_back(
        TransformCameraWorld(world_from_enu, HeldCamera(enu, 25.0 * double(i), -90)));
  }
  const auto fit = Fit(walk);
  ASSERT_TRUE(fit);
  EXPECT_LT(FarthestOff(fit->enu_from_world, walk), 5);
}

// Walked along a straight street, places do not tell up from down: cameras do.
TEST(FitEarth, AStraightWalkIsNotUpsideDown) {
  for (uint64_t seed = 1; seed <= 30; ++seed) {
    Walk walk = MakeWalk(seed, 24, 0, 8, 1);
    for (EarthAnchor& anchor : walk.anchors) anchor.has_open_height = true;
    const auto fit = Fit(walk);
    ASSERT_TRUE(fit);
    const Eigen::Vector3d up =
        fit->enu_from_world.rotation * (kTruth.rotation.conjugate() * Eigen::Vector3d::UnitZ());
    EXPECT_GT(up.z(), 0.9) << seed;
  }
}

// Forty metres of a street, with GPS that is off by twelve: the positions tell the heading badly.
TEST(FitEarth, CompassesTellWherePositionsHardlyDo) {
  double with = 0, without = 0;
  int honest = 0;
  constexpr int kWalks = 60;
  for (int seed = 1; seed <= kWalks; ++seed) {
    Walk walk = MakeWalk(static_cast<uint64_t>(seed), 12, 0, 12, 1);
    SeededRandom random(static_cast<uint64_t>(seed));
    const Eigen::Vector3d first = walk.anchors[0].world;
    for (EarthAnchor& anchor : walk.anchors) {
      const Eigen::Vector3d error = anchor.enu_m - kTruth * anchor.world;
      anchor.world = first + 0.4 * (anchor.world - first);
      anchor.enu_m = kTruth * anchor.world + error;
    }
    std::vector<EarthHeading> headings;
    const double compass_deg = 8 * Normal(&random);
    for (const Rigid3& cam : walk.cams) {
      const Eigen::Vector3d forward = cam.rotation.conjugate() * Eigen::Vector3d::UnitZ(),
                            enu = kTruth.rotation * forward;
      headings.push_back({forward,
                          std::atan2(enu.x(), enu.y()) * 180 / std::numbers::pi + compass_deg +
                              12 * Normal(&random),
                          1});
    }
    const auto by_both = FitEarth(walk.anchors, headings, FindUp(walk.cams)), by_gps = Fit(walk);
    ASSERT_TRUE(by_both && by_gps);
    const auto off_deg = [](const EarthFit& fit) {
      const Eigen::Quaterniond turn = fit.enu_from_world.rotation * kTruth.rotation.conjugate();
      return 2 * std::atan2(std::abs(turn.z()), std::abs(turn.w())) * 180 / std::numbers::pi;
    };
    with += off_deg(*by_both) * off_deg(*by_both) / kWalks;
    without += off_deg(*by_gps) * off_deg(*by_gps) / kWalks;
    honest += off_deg(*by_both) <= 2 * by_both->heading_deviation_deg ? 1 : 0;
  }
  std::printf(
      "heading off by %.1f degrees with compasses, by %.1f without; %d of %d within two "
      "standard deviations\n",
      std::sqrt(with), std::sqrt(without), honest, kWalks);
  EXPECT_LT(std::sqrt(with), 15);
  EXPECT_LT(with, without);
  EXPECT_GE(honest, kWalks * 9 / 10);
}

TEST(FitEarth, ACompassThatIsWrongDoesNotTurnIt) {
  const Walk walk = MakeWalk(3, 20, 30, 1, 0);
  std::vector<EarthHeading> headings;
  for (const Rigid3& cam : walk.cams)
    headings.push_back({cam.rotation.conjugate() * Eigen::Vector3d::UnitZ(), 17, 1});
  const auto fit = FitEarth(walk.anchors, headings, FindUp(walk.cams));
  ASSERT_TRUE(fit);
  EXPECT_LT(FarthestOff(fit->enu_from_world, walk), 3);
}

TEST(FitEarth, TooLittleIsNothing) {
  const Walk walk = MakeWalk(6, 12, 20, 2, 0);
  const auto up = FindUp(walk.cams);
  EXPECT_FALSE(FitEarth({}, {}, up));
  EXPECT_FALSE(FitEarth(std::span(walk.anchors).first(2), {}, up));
  EXPECT_FALSE(FitEarth(walk.anchors, {}, {}));
  // All in one place: neither scale nor heading.
  std::vector<EarthAnchor> one(5, walk.anchors.front());
  EXPECT_FALSE(FitEarth(one, {}, up));
}

// The end of the street is off by what the covariance says, over many walks of each kind.
TEST(FitEarth, SaysHowFarItMayBeOff) {
  struct Kind {
    uint32_t groups;
    double common_times;  // above 1: receivers that are farther off than they say
  };
  for (const auto& [groups, common_times] :
       {Kind{0, 1}, Kind{1, 1}, Kind{3, 1}, Kind{5, 1}, Kind{5, 8}}) {
    int inside = 0;
    double squares = 0;
    constexpr int kWalks = 200;
    for (int i = 0; i < kWalks; ++i) {
      const Walk walk = MakeWalk(100 + static_cast<uint64_t>(i), 30, 25, 4, groups, common_times);
      const auto fit = Fit(walk);
      ASSERT_TRUE(fit);
      const Eigen::Vector3d x = fit->enu_from_world * walk.anchors.back().world;
      const Eigen::Vector3d from_pivot = x - fit->pivot;
      Eigen::Matrix<double, 3, 7> jacobian;
      jacobian << from_pivot, Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Identity();
      for (int axis = 0; axis < 3; ++axis)
        jacobian.col(1 + axis) = Eigen::Vector3d::Unit(axis).cross(from_pivot);
      const Eigen::Matrix3d covariance = jacobian * fit->covariance * jacobian.transpose();
      const Eigen::Vector3d error = x - kTruth * walk.anchors.back().world;
      const double squared = error.dot(covariance.ldlt().solve(error));
      inside += squared < 7.815;  // 95 % of chi-squared with three degrees of freedom
      squares += squared;
    }
    const bool is_honest = common_times == 1;
    EXPECT_GE(inside, kWalks * (is_honest ? 0.9 : 0.75)) << groups << " " << common_times;
    // 3 where it is exactly so.
    EXPECT_LE(squares / kWalks, is_honest ? 4 : 6) << groups << " " << common_times;
    // Not far more careful than it need be.
    EXPECT_GE(squares / kWalks, 1.2) << groups << " " << common_times;
  }
}

}  // namespace
}  // namespace veduta
