// SPDX-License-Identifier: Apache-2.0
// Goal: photos that say where they were taken place their reconstruction on the earth, and so do
//   surveyed points, more exactly; the answers tell both; what is taken out again is forgotten.
// Method: a walk along a rendered street, whose GPS errs by 2 m, half of it in common; points of
//   the street that the true cameras see, as a file of ODM.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "engine/camera/projection.h"
#include "engine/earth/local_frame.h"
#include "tests/engine/street_fixture.h"
#include "tools/render/street/gps_tags.h"

namespace veduta {
namespace {

constexpr double kGpsM = 2;

std::vector<Stand> TheWalk() {
  return Walk(5, 0.8, 14);
}

PhotoSubmission WithGps(City* city, const Stand& stand, uint64_t number) {
  PhotoSubmission photo = city->Submit(stand);
  const Eigen::Vector3d center = TakePhoto(stand).cam_from_world.Center();
  const Eigen::Vector3d received = street::ReceivedPosition(center, kGpsM, 11, number);
  const auto tagged = street::WithGpsTags(*photo.photo.bytes, street::FixAt(received, kGpsM));
  EXPECT_OK(tagged);
  photo.photo.bytes = *tagged;
  return photo;
}

void AddWithGps(City* city, const std::vector<Stand>& stands) {
  std::vector<PhotoSubmission> photos;
  for (size_t i = 0; i < stands.size(); ++i) photos.push_back(WithGps(city, stands[i], i));
  for (const AddOutcome& outcome : city->Add(photos))
    EXPECT_NE(outcome.verdict, Verdict::kRejected) << outcome.detail;
}

// From where the photo is said to be to where it was taken, metres.
Eigen::Vector3d ErrorOf(const City& city, const Stand& stand) {
  const TakenPhoto& truth = TakePhoto(stand);
  const auto image = city.Ask().door().Image(truth.name);
  EXPECT_OK(image);
  EXPECT_TRUE(image.ok() && image->on_earth);
  if (!image.ok() || !image->on_earth) return Eigen::Vector3d::Constant(1e9);
  return LocalFrame(street::kStreetOrigin).FromGeo(image->on_earth->position) -
         truth.cam_from_world.Center();
}

// Lines for points of the street, as the true cameras of the stands see them. Each is off by
// `error_px` to a side that changes.
std::string GroundLines(const std::vector<Stand>& stands, double error_px) {
  std::string text = "EPSG:4326\n";
  const CameraModel camera = StreetCameraModel();
  const std::vector<Eigen::Vector3d> points = {{7, 6, 3}, {11, 6.5, 1}, {15, 6, 5}, {9, 7, 6}};
  int turn = 0;
  for (size_t p = 0; p < points.size(); ++p) {
    const GeoPosition position = LocalFrame(street::kStreetOrigin).ToGeo(points[p]);
    for (const Stand& stand : stands) {
      const TakenPhoto& photo = TakePhoto(stand);
      const auto px = PixelFromBearing(camera, photo.cam_from_world * points[p]);
      if (!px || px->x() < 0 || px->y() < 0 || px->x() > 511 || px->y() > 383) continue;
      const double off = error_px * (++turn % 2 == 0 ? 1 : -1);
      char line[256];
      std::snprintf(line, sizeof(line), "%.10f\t%.10f\t%.4f\t%.3f\t%.3f\t%s\tpoint %zu\n",
                    position.longitude_deg, position.latitude_deg, position.height_m, px->x() + off,
                    px->y() - off, photo.name.c_str(), p);
      text += line;
    }
  }
  return text;
}

std::string Write(const TemporaryFolder& folder, const std::string& text) {
  const std::string path = folder / "gcp_list.txt";
  std::ofstream(path) << text;
  return path;
}

size_t EntriesOf(const City& city, const std::string& action) {
  const auto journal = city.Ask().door().Journal(1, 10'000);
  EXPECT_OK(journal);
  return static_cast<size_t>(std::ranges::count(*journal, action, &JournalAnswer::action));
}

TEST(Georeferencing, PhotosPlaceTheCityByThemselves) {
  City city;
  const std::vector<Stand> walk = TheWalk();
  AddWithGps(&city, walk);
  const auto answer = city.Ask().door().Georeference();
  ASSERT_OK(answer);
  ASSERT_EQ(answer->reconstructions.size(), 1u);
  const EarthAnswer& earth = answer->reconstructions.front();
  ASSERT_TRUE(earth.is_known);
  EXPECT_EQ(earth.fixes.used, walk.size());
  EXPECT_GE(earth.fixes.agreeing, walk.size() - 1);
  EXPECT_EQ(earth.ground_points.used, 0u);
  EXPECT_EQ(earth.version, EntriesOf(city, "georeference"));
  EXPECT_NEAR(earth.origin.latitude_deg, street::kStreetOrigin.latitude_deg, 1e-3);
  // No better than its accuracy, and not three times worse than it says.
  for (const Stand& stand : walk) {
    const auto image = city.Ask().door().Image(TakePhoto(stand).name);
    ASSERT_OK(image);
    ASSERT_TRUE(image->gps && image->on_earth);
    const EarthPose& pose = *image->on_earth;
    EXPECT_GT(pose.horizontal_stddev_m, 1);
    const Eigen::Vector3d error = ErrorOf(city, stand);
    EXPECT_LT(error.head<2>().norm(), 3 * pose.horizontal_stddev_m);
    EXPECT_LT(std::abs(error.z()), 3 * pose.vertical_stddev_m);
    EXPECT_LT(std::abs(pose.roll_deg), 8);
  }
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  const std::string digest = city.Digest();
  City again(City::Options(1));
  AddWithGps(&again, walk);
  EXPECT_EQ(again.Digest(), digest);
  city.Reopen();
  EXPECT_EQ(city.Digest(), digest);
}

TEST(Georeferencing, ACityThatNothingPlacesIsAsBefore) {
  City city;
  city.Add(TheWalk());
  EXPECT_EQ(EntriesOf(city, "georeference"), 0u);
  const auto image = city.Ask().door().Image(TakePhoto(TheWalk().front()).name);
  ASSERT_OK(image);
  EXPECT_FALSE(image->gps);
  EXPECT_FALSE(image->on_earth);
  const auto answer = city.Ask().door().Georeference();
  ASSERT_OK(answer);
  ASSERT_EQ(answer->reconstructions.size(), 1u);
  EXPECT_FALSE(answer->reconstructions.front().is_known);
  EXPECT_EQ(answer->reconstructions.front().version, 0u);
}

TEST(Georeferencing, SurveyedPointsPlaceItExactly) {
  City city;
  const std::vector<Stand> walk = TheWalk();
  AddWithGps(&city, walk);
  const auto before = city.Ask().door().Georeference();
  ASSERT_OK(before);
  const TemporaryFolder folder;
  const std::string path =
      Write(folder, GroundLines(walk, 0.5) + "15.44\t47.07\t350\t1\t2\tnot there.jpg\tfar\n");
  const auto placed = city.engine().Georeference(
      {.ground_points_path = path, .ground_deviation_m = 0.02, .actor = "surveyor"});
  ASSERT_OK(placed);
  EXPECT_EQ(placed->points_read, 4u);
  EXPECT_EQ(placed->unknown_photos, std::vector<std::string>{"not there.jpg"});
  ASSERT_EQ(placed->ground_points.size(), 4u);
  for (const GroundPointAnswer& ground : placed->ground_points) {
    EXPECT_EQ(ground.reconstruction, ReconstructionId(1)) << ground.point.name;
    for (const double error : ground.error_m) EXPECT_LT(std::abs(error), 0.1) << ground.point.name;
    EXPECT_LT(ground.error_px, 2) << ground.point.name;
  }
  const EarthAnswer& earth = placed->reconstructions.front();
  EXPECT_EQ(earth.version, before->reconstructions.front().version + 1);
  EXPECT_EQ(earth.ground_points.agreeing, 4u);
  EXPECT_EQ(earth.origin, before->reconstructions.front().origin);
  for (const Stand& stand : walk) EXPECT_LT(ErrorOf(city, stand).norm(), 0.2);
  EXPECT_EQ(EntriesOf(city, "ground"), 1u);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  // More photos come: the place stays where the points have it.
  const Stand later{17.2, 90};
  city.Add(std::vector<PhotoSubmission>{WithGps(&city, later, 100)});
  EXPECT_LT(ErrorOf(city, later).norm(), 0.3);
}

TEST(Georeferencing, WhatIsTakenOutIsForgotten) {
  City city;
  const std::vector<Stand> walk = TheWalk();
  std::vector<PhotoSubmission> photos;
  for (size_t i = 0; i < walk.size(); ++i)
    photos.push_back(i % 4 == 0 ? WithGps(&city, walk[i], i) : city.Submit(walk[i]));
  city.Add(photos);
  const TemporaryFolder folder;
  const std::string path = Write(folder, GroundLines(walk, 0));
  const auto placed = city.engine().Georeference({.ground_points_path = path});
  ASSERT_OK(placed);
  ASSERT_TRUE(placed->reconstructions.front().is_known);
  const ImageId removed = city.Ask().FindImage(TakePhoto(walk[4]).name)->id;
  const auto count_sightings = [&](const GeoreferenceAnswer& answer) {
    size_t count = 0;
    for (const GroundPointAnswer& ground : answer.ground_points)
      count += static_cast<size_t>(
          std::ranges::count(ground.point.sightings, removed, &GroundSighting::image));
    return count;
  };
  ASSERT_GT(count_sightings(*placed), 0u);
  RemoveRequest request;
  request.photos = {TakePhoto(walk[4]).name};
  ASSERT_OK(city.engine().Remove(request));
  ASSERT_OK(city.engine().Settle());
  const auto after = city.Ask().door().Georeference();
  ASSERT_OK(after);
  EXPECT_EQ(after->ground_points.size(), placed->ground_points.size());
  EXPECT_EQ(count_sightings(*after), 0u);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  // Without the points, and then without the other photos with GPS, nothing is known any more.
  GeoreferenceRequest forget;
  forget.forget_ground_points = true;
  const auto forgotten = city.engine().Georeference(forget);
  ASSERT_OK(forgotten);
  EXPECT_TRUE(forgotten->ground_points.empty());
  request.photos = {TakePhoto(walk[0]).name, TakePhoto(walk[8]).name, TakePhoto(walk[12]).name};
  ASSERT_OK(city.engine().Remove(request));
  ASSERT_OK(city.engine().Settle());
  const auto lost = city.Ask().door().Georeference();
  ASSERT_OK(lost);
  EXPECT_FALSE(lost->reconstructions.front().is_known);
  EXPECT_GT(lost->reconstructions.front().version, 0u);
  const auto image = city.Ask().door().Image(TakePhoto(walk[6]).name);
  ASSERT_OK(image);
  EXPECT_FALSE(image->on_earth);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

TEST(Georeferencing, APhotoThatIsNotAddedIsOnTheEarthToo) {
  City city;
  AddWithGps(&city, TheWalk());
  const TakenPhoto& asked = TakePhoto({9.4, 92});
  const LocalizeRequest request{{asked.name, asked.name, asked.jpeg}, "street"};
  std::optional<EarthPose> on_earth;
  ASSERT_OK(city.Ask().door().Localize(
      {&request, 1}, [&](const LocalizedPhoto& photo) { on_earth = photo.on_earth; }));
  ASSERT_TRUE(on_earth);
  const Eigen::Vector3d off =
      LocalFrame(street::kStreetOrigin).FromGeo(on_earth->position) - asked.cam_from_world.Center();
  EXPECT_LT(off.head<2>().norm(), 3 * on_earth->horizontal_stddev_m);
}

TEST(Georeferencing, WrongFilesAreNamedAndChangeNothing) {
  City city;
  city.Add(Walk(5, 0.8, 4));
  const std::string digest = city.Digest();
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& text, StatusCode code, const std::string& why) {
    const auto answer = city.engine().Georeference({.ground_points_path = Write(folder, text)});
    EXPECT_EQ(answer.status().code(), code) << text;
    EXPECT_NE(answer.status().message().find(why), std::string::npos) << answer.status().message();
  };
  const std::string name = TakePhoto(Walk(5, 0.8, 4).front()).name;
  refused("", StatusCode::kInvalidArgument, "is empty");
  refused("EPSG:4326\n1 2 3\n", StatusCode::kInvalidArgument, "line 2");
  refused("EPSG:4326\n15 47 0 1 2 none.jpg p\n", StatusCode::kNotFound, "none.jpg");
  const std::string line = "15 47 0 1 2 " + name + " p\n";
  refused("EPSG:4326\n" + line + line, StatusCode::kInvalidArgument, "two places");
  refused("EPSG:4326\n15 47 0 99999 2 " + name + " p\n", StatusCode::kInvalidArgument,
          "outside of photo");
  const auto missing = city.engine().Georeference({.ground_points_path = folder / "no such file"});
  EXPECT_FALSE(missing.ok());
  EXPECT_NE(missing.status().message().find("no such file"), std::string::npos);
  GeoreferenceRequest exact;
  exact.ground_deviation_m = 0;
  const auto unsure = city.engine().Georeference(exact);
  EXPECT_EQ(unsure.status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(city.Digest(), digest);
}

}  // namespace
}  // namespace veduta
