// SPDX-License-Identifier: Apache-2.0
// Goal: tourists' photos of a landmark, each of a camera of its own of which nothing is known,
//   begin a city: all of them stand in one reconstruction, with focal lengths that COLMAP finds,
//   too.
// Method: eight of the photos of landmarks/moulinrouge. Skipped where they are missing.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

const std::string kFolder = VEDUTA_TEST_DATA "/landmarks/moulinrouge";

// With the focal length that COLMAP 3.8 finds, in px, of 42 of all 50 photos.
struct TouristPhoto {
  const char* name;
  double focal_px;
};
constexpr TouristPhoto kPhotos[] = {
    {"paris_moulinrouge_000091.jpg", 806}, {"paris_moulinrouge_000182.jpg", 895},
    {"paris_moulinrouge_000331.jpg", 850}, {"paris_moulinrouge_000485.jpg", 848},
    {"paris_moulinrouge_000494.jpg", 922}, {"paris_moulinrouge_000528.jpg", 960},
    {"paris_moulinrouge_000531.jpg", 768}, {"paris_moulinrouge_000533.jpg", 807}};

TEST(Tourists, PhotosOfOneLandmarkBeginACity) {
  if (!std::filesystem::exists(kFolder))
    GTEST_SKIP() << "the photos of landmarks/moulinrouge are missing";
  City city;
  std::vector<PhotoSubmission> photos;
  for (const TouristPhoto& photo : kPhotos) {
    std::ifstream file(kFolder + "/" + photo.name, std::ios::binary);
    std::vector<uint8_t> bytes{std::istreambuf_iterator<char>(file), {}};
    photos.push_back({{photo.name, photo.name, std::move(bytes)}, "", "a tourist"});
  }
  const auto cameras = city.engine().CalibrateFirst(photos);
  ASSERT_OK(cameras);
  city.Add(photos);
  const CityQuestions ask = city.Ask();
  std::set<ReconstructionId> places;
  for (const TouristPhoto& photo : kPhotos) {
    const auto image = ask.FindImage(photo.name);
    ASSERT_OK(image);
    const auto pose = ask.Pose(image->id);
    ASSERT_OK(pose);
    ASSERT_TRUE(pose->has_value()) << photo.name;
    places.insert((*pose)->reconstruction);
    const auto camera = ask.snapshot().GetCamera(image->camera);
    ASSERT_OK(camera);
    EXPECT_NEAR(camera->model.fx / photo.focal_px, 1, 0.03) << photo.name;
  }
  EXPECT_EQ(places.size(), 1u);
  EXPECT_TRUE(IsSound(ask.snapshot()));
}

}  // namespace
}  // namespace veduta
