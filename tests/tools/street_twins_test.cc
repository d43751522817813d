// SPDX-License-Identifier: Apache-2.0
// Goal: twin facades are exactly alike and their surroundings are not, wherever they stand; a scene
//   without room for them is refused.
// Method: photograph both places of each pair square on from the same distance; compare windows
//   above the trees, what is in front of the ground floor, and what is beside the place.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <utility>
#include <vector>

#include "street_view.h"
#include "tools/render/street/twin_facades.h"

namespace veduta::street {
namespace {

constexpr double kDistanceM = 9;

SceneOptions WithTwins(Trajectory trajectory, TwinFacades twins, double length_m) {
  SceneOptions options = SceneForTrajectory(trajectory, 150, length_m);
  options.twin_facades = twins;
  return options;
}

// Square on the facade, `aside` metres to the right of the middle of a place, at `height`.
StreetPhoto Before(const Scene& scene, const TwinPlace& place, double aside, double height) {
  const BlockEdge edge = EdgeOf(scene.plan().blocks[place.block], place.side);
  const Eigen::Vector2d outward(edge.along.y(), -edge.along.x());
  const Eigen::Vector2d foot = MiddleOf(place, scene.plan()) + aside * edge.along;
  const Eigen::Vector2d at = foot + kDistanceM * outward;
  const double yaw = std::atan2(-outward.y(), -outward.x()) * 180 / M_PI;
  const CameraModel model = MakeModel(320, 240, 700);  // 4.1 m by 3.1 m of the facade
  return Take(scene, {"square", model, LookFrom({at.x(), at.y(), height}, yaw, 0, 0)}).photo;
}

// The share of pixels that differ by more than 3 grey levels in green.
double Difference(const StreetPhoto& a, const StreetPhoto& b) {
  size_t count = 0;
  for (size_t i = 1; i < a.rgb.size(); i += 3) count += std::abs(a.rgb[i] - b.rgb[i]) > 3;
  return 3.0 * static_cast<double>(count) / static_cast<double>(a.rgb.size());
}

// Each place of each pair beside its twin.
void ExpectTwins(const SceneOptions& options, size_t pairs, double apart_m_min,
                 double apart_m_max) {
  const auto scene = Build(options);
  const std::vector<TwinPlace>& places = scene->plan().twins;
  ASSERT_EQ(places.size(), 2 * pairs);
  for (size_t i = 0; i < places.size(); i += 2) {
    const TwinPlace &a = places[i], &b = places[i + 1];
    ASSERT_EQ(a.pair, b.pair);
    ASSERT_EQ(a.length_m, b.length_m);
    const double apart =
        (MiddleOf(a, scene->plan()) - MiddleOf(b, scene->plan())).norm() - a.length_m;
    EXPECT_GT(apart, apart_m_min);
    EXPECT_LT(apart, apart_m_max);
    const double half = a.length_m / 2;
    for (const double aside : {-half + 2.2, 0.0, half - 2.2}) {
      // Above the trees, where no sign hangs.
      const double above = Difference(Before(*scene, a, aside, 7.5), Before(*scene, b, aside, 7.5));
      EXPECT_LT(above, 0.02) << "pair " << a.pair << ", " << aside << " m";
    }
    double on_the_ground = 0;
    for (const double aside : {-half + 2.2, 0.0, half - 2.2})
      on_the_ground += Difference(Before(*scene, a, aside, 1.0), Before(*scene, b, aside, 1.0)) / 3;
    EXPECT_GT(on_the_ground, 0.2) << "pair " << a.pair;
    for (const double aside : {-half - 2.2, half + 2.2}) {
      const double beside =
          Difference(Before(*scene, a, aside, 7.5), Before(*scene, b, aside, 7.5));
      EXPECT_GT(beside, 0.5) << "pair " << a.pair << ", " << aside << " m";
    }
  }
  // Two pairs are no quadruplets.
  for (size_t i = 2; i < places.size(); i += 2) {
    EXPECT_GT(Difference(Before(*scene, places[0], 0, 7.5), Before(*scene, places[i], 0, 7.5)),
              0.5);
  }
}

TEST(StreetTwins, NearEachOther) {
  ExpectTwins(WithTwins(Trajectory::kStreet, TwinFacades::kNear, 0), 2, 7.9, 8.1);
  ExpectTwins(WithTwins(Trajectory::kStreet, TwinFacades::kNear, 500), 1, 7.9, 8.1);
  ExpectTwins(WithTwins(Trajectory::kLoop, TwinFacades::kNear, 0), 2, 7.9, 8.1);
}

TEST(StreetTwins, FarFromEachOther) {
  ExpectTwins(WithTwins(Trajectory::kStreet, TwinFacades::kFar, 0), 2, 90, 100);
  ExpectTwins(WithTwins(Trajectory::kStreet, TwinFacades::kFar, 500), 1, 100, 1000);
  ExpectTwins(WithTwins(Trajectory::kLoop, TwinFacades::kFar, 0), 2, 40, 50);
}

// The two places look in different directions, and are lit alike all the same.
TEST(StreetTwins, WhereALoopBeginsAndEnds) {
  const SceneOptions options = WithTwins(Trajectory::kLoop, TwinFacades::kEnds, 0);
  ExpectTwins(options, 1, 15, 25);
  RigOptions rig;
  rig.trajectory = Trajectory::kLoop;
  rig.photos = 150;
  rig.model = MakeModel(128, 96, 112);
  const auto cameras = MakeCameras(options, rig).value();
  const Plan plan = MakePlan(options);
  // Which photo stands nearest to the foot of each place.
  std::vector<size_t> nearest;
  for (const TwinPlace& place : plan.twins) {
    const auto distance = [&](size_t i) {
      return (cameras[i].cam_from_world.Center().head<2>() - MiddleOf(place, plan)).norm();
    };
    size_t best = 0;
    for (size_t i = 1; i < cameras.size(); ++i) best = distance(i) < distance(best) ? i : best;
    nearest.push_back(best);
  }
  EXPECT_LT(nearest[0], 30u);
  EXPECT_GT(nearest[1], 120u);
}

TEST(StreetTwins, OtherSeedsMakeOtherTwins) {
  SceneOptions options = WithTwins(Trajectory::kStreet, TwinFacades::kNear, 0);
  const auto one = Build(options), again = Build(options);
  options.seed = 2;
  const auto two = Build(options);
  const TwinPlace& place = one->plan().twins[0];
  EXPECT_EQ(Before(*one, place, 0, 7.5).rgb, Before(*again, place, 0, 7.5).rgb);
  EXPECT_GT(Difference(Before(*one, place, 0, 7.5), Before(*two, place, 0, 7.5)), 0.5);
}

TEST(StreetTwins, NoRoomIsRefused) {
  const std::pair<SceneOptions, const char*> refused[] = {
      {WithTwins(Trajectory::kStreet, TwinFacades::kEnds, 0), "need a loop"},
      {WithTwins(Trajectory::kOrbit, TwinFacades::kNear, 0), "a street or a loop"},
      {WithTwins(Trajectory::kStreet, TwinFacades::kNear, 37.9), "need 38"},
      {WithTwins(Trajectory::kStreet, TwinFacades::kFar, 69.9), "need 70"},
      {WithTwins(Trajectory::kLoop, TwinFacades::kEnds, 107), "need 108"},
      {WithTwins(Trajectory::kLoop, TwinFacades::kNear, 171), "need 172"}};
  for (const auto& [options, words] : refused) {
    EXPECT_EQ(CheckTwinFacades(options).code(), StatusCode::kInvalidArgument);
    EXPECT_EQ(BuildScene(options).status().code(), StatusCode::kInvalidArgument);
    EXPECT_NE(CheckTwinFacades(options).message().find(words), std::string::npos)
        << CheckTwinFacades(options).message();
  }
  SceneOptions both = WithTwins(Trajectory::kStreet, TwinFacades::kNear, 0);
  EXPECT_TRUE(CheckTwinFacades(both).ok());
  both.repeated_windows = true;
  EXPECT_EQ(CheckTwinFacades(both).code(), StatusCode::kInvalidArgument);
  // The smallest there are.
  ExpectTwins(WithTwins(Trajectory::kStreet, TwinFacades::kNear, 38), 2, 7.9, 8.1);
  ExpectTwins(WithTwins(Trajectory::kLoop, TwinFacades::kEnds, 108), 1, 10, 25);
}

TEST(StreetTwins, TheReadmeSaysWhereTheyAre) {
  Folder folder("twins");
  DataSetOptions options;
  options.rig.model = MakeModel(64, 48, 56);
  options.rig.photos = 2;
  options.scene = WithTwins(Trajectory::kStreet, TwinFacades::kFar, 80);
  ASSERT_TRUE(RenderStreet(options, folder.str(), nullptr).ok());
  std::ifstream file(folder / "README");
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  EXPECT_NE(text.find("\n0 15 7.5 7\n0 15 72.5 7\n1 15 72.5 -7\n1 15 7.5 -7\n"), std::string::npos)
      << text;
}

}  // namespace
}  // namespace veduta::street
