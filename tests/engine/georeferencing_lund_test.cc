// SPDX-License-Identifier: Apache-2.0
// Goal: a real walk with a phone's GPS comes to lie where it was: along the street, as long as it,
//   the camera looking ahead; and what is said of the errors is so.
// Method: the photos of streets/lund with the positions of gps.csv written into their EXIF; of
//   every second photo alone, and the others are asked. Skipped where the photos are missing.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "engine/earth/local_frame.h"
#include "tests/engine/street_fixture.h"
#include "tools/render/street/gps_tags.h"

namespace veduta {
namespace {

const std::string kFolder = VEDUTA_TEST_DATA "/streets/lund";

struct WalkedPhoto {
  std::string name;
  GpsFix fix;
};

std::vector<WalkedPhoto> ReadWalk() {
  std::vector<WalkedPhoto> walk;
  std::ifstream file(kFolder + "/gps.csv");
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::istringstream fields(line);
    WalkedPhoto photo;
    std::getline(fields, photo.name, ',');
    char comma = 0;
    double height = 0;
    fields >> photo.fix.latitude_deg >> comma >> photo.fix.longitude_deg >> comma >> height >>
        comma >> photo.fix.accuracy_m;
    photo.fix.height_m = height;
    walk.push_back(photo);
  }
  return walk;
}

std::vector<uint8_t> BytesOf(const WalkedPhoto& photo) {
  std::ifstream file(kFolder + "/" + photo.name, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// Adds all photos; those whose index fits tell where they were taken.
template <typename Tells>
void AddWalk(City* city, const std::vector<WalkedPhoto>& walk, const Tells& tells) {
  CameraModel phone;
  phone.width_px = 1024;
  phone.height_px = 768;
  phone.fx = phone.fy = 1000;
  phone.cx = phone.u0 = 511.5;
  phone.cy = phone.v0 = 383.5;
  ASSERT_OK(city->engine().AddCamera("phone", phone, "EXIF"));
  std::vector<PhotoSubmission> photos;
  for (size_t i = 0; i < walk.size(); ++i) {
    std::vector<uint8_t> bytes = BytesOf(walk[i]);
    if (tells(i)) bytes = *street::WithGpsTags(bytes, walk[i].fix);
    photos.push_back({{walk[i].name, walk[i].name, std::move(bytes)}, "phone", "walker"});
  }
  city->Add(photos);
}

std::optional<EarthPose> PoseOf(const City& city, const WalkedPhoto& photo) {
  const auto image = city.Ask().door().Image(photo.name);
  EXPECT_OK(image);
  return image.ok() ? image->on_earth : std::nullopt;
}

GeoPosition PositionOf(const GpsFix& fix) {
  return {fix.latitude_deg, fix.longitude_deg, *fix.height_m};
}

class Lund : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(kFolder)) GTEST_SKIP() << kFolder << " is missing";
    walk_ = ReadWalk();
    ASSERT_EQ(walk_.size(), 29u);
  }
  std::vector<WalkedPhoto> walk_;
};

TEST_F(Lund, LiesAlongItsStreet) {
  City city;
  AddWalk(&city, walk_, [](size_t) { return true; });
  const auto answer = city.Ask().door().Georeference();
  ASSERT_OK(answer);
  const EarthAnswer& earth = answer->reconstructions.front();
  ASSERT_TRUE(earth.is_known);
  EXPECT_GE(earth.images, 15u);
  EXPECT_GE(earth.fixes.agreeing + 1, earth.fixes.used);
  const LocalFrame frame(earth.origin);
  std::vector<Eigen::Vector3d> fitted, told;
  std::vector<double> headings;
  for (const WalkedPhoto& photo : walk_) {
    const std::optional<EarthPose> pose = PoseOf(city, photo);
    if (!pose) continue;
    fitted.push_back(frame.FromGeo(pose->position));
    told.push_back(frame.FromGeo(PositionOf(photo.fix)));
    headings.push_back(pose->heading_deg);
    EXPECT_LT(std::abs(pose->roll_deg), 10) << photo.name;
    EXPECT_LT(std::abs(pose->pitch_deg), 20) << photo.name;
  }
  const Eigen::Vector3d way = fitted.back() - fitted.front(), told_way = told.back() - told.front();
  EXPECT_NEAR(way.head<2>().norm() / told_way.head<2>().norm(), 1, 0.1);
  const double course_deg = std::atan2(told_way.x(), told_way.y()) * 180 / M_PI;
  std::ranges::sort(headings);
  const double off_deg = std::remainder(headings[headings.size() / 2] - course_deg, 360.0);
  // People look to the houses a little; the whole set looks along the street.
  EXPECT_LT(std::abs(off_deg), 20);
  EXPECT_LT(earth.heading_stddev_deg, 10);
  std::printf(
      "%zu photos on the earth, %.1f m, GPS says %.1f m; heading %.1f degrees off the course; "
      "stddev: heading %.2g, tilt %.2g, scale %.2g %%, position %.2g m (height %.2g m); fixes "
      "agree to %.2g m\n",
      fitted.size(), way.head<2>().norm(), told_way.head<2>().norm(), off_deg,
      earth.heading_stddev_deg, earth.tilt_stddev_deg, 100 * earth.scale_stddev_share,
      earth.horizontal_stddev_m, earth.vertical_stddev_m, earth.fixes.error_m);
}

TEST_F(Lund, WhatItSaysOfItsErrorsIsSo) {
  for (const size_t odd : {0u, 1u}) {
    City city;
    AddWalk(&city, walk_, [&](size_t i) { return i % 2 == odd; });
    double squares = 0;
    size_t count = 0;
    for (size_t i = 1 - odd; i < walk_.size(); i += 2) {
      const std::optional<EarthPose> pose = PoseOf(city, walk_[i]);
      if (!pose) continue;
      const Eigen::Vector3d error = LocalFrame(pose->position).FromGeo(PositionOf(walk_[i].fix));
      const double gps = walk_[i].fix.accuracy_m;
      const double variance = pose->horizontal_stddev_m * pose->horizontal_stddev_m + 2 * gps * gps;
      squares += error.head<2>().squaredNorm() / variance;
      EXPECT_LT(error.head<2>().squaredNorm() / variance, 9) << walk_[i].name;
      ++count;
    }
    ASSERT_GE(count, 6u);
    std::printf("%zu photos that do not tell: root mean square error over the stated one %.2f\n",
                count, std::sqrt(squares / double(count)));
    EXPECT_LT(std::sqrt(squares / double(count)), 1.5);
  }
}

}  // namespace
}  // namespace veduta
