// SPDX-License-Identifier: Apache-2.0
// Goal: where a reconstruction has taken one place for another, the images of the second place are
//   found, with those that nobody asked about; where it shows one place, and where only an image or
//   two see less than others, or most verified pairs across agree, nothing is.
// Method: a synthetic scene of two sides far apart, stored as one reconstruction: with both at
//   their true places, and with the second side laid over the first.
#include "engine/ingest/mixed_places.h"

#include <gtest/gtest.h>

#include "tests/engine/ingest/overlaid_scene.h"
#include "tests/engine/ingest/torn_scene.h"

namespace veduta {
namespace {

// Lays the second side over the first one.
void AddOverlaid(SceneDatabase* scene) {
  scene->AddImages(0, 8);
  Sim3 over;
  over.translation.x() = -kTwoSides.beside;
  AddOverlaid(scene, {0, 1, 2, 3}, {4, 5, 6, 7}, over);
}

std::vector<ImageId> Find(SceneDatabase* scene, std::vector<ImageId> asked,
                          const DoubtOptions& doubt = {}) {
  SceneWork work(scene);
  work.options.doubt = doubt;
  EXPECT_OK(work.loader.LoadNeighborhood(asked));
  const auto found = FindOtherPlace(work.context, asked);
  EXPECT_OK(found);
  return found.ok() ? *found : std::vector<ImageId>();
}

std::vector<ImageId> AllImages() {
  std::vector<ImageId> all = SideImages(0);
  for (const ImageId id : SideImages(1)) all.push_back(id);
  return all;
}

TEST(MixedPlaces, OnePlaceIsOne) {
  SceneDatabase scene(kTwoSides);
  AddTwoSides(&scene);
  EXPECT_TRUE(Find(&scene, AllImages()).empty());
  EXPECT_TRUE(Find(&scene, {}).empty());
}

TEST(MixedPlaces, OfTwoAsLargeThatWithoutTheFirstImageIsTheOther) {
  for (const size_t thread_count : {1, 2}) {
    SceneDatabase scene(kTwoSides, thread_count);
    AddOverlaid(&scene);
    EXPECT_EQ(Find(&scene, AllImages()), SideImages(1));
  }
}

TEST(MixedPlaces, WhoWasNotAskedGoesWithHisPairs) {
  SceneDatabase scene(kTwoSides);
  AddOverlaid(&scene);
  std::vector<ImageId> asked = AllImages();
  std::erase(asked, ImageId(2));
  std::erase(asked, ImageId(8));
  EXPECT_EQ(Find(&scene, asked), SideImages(1));
}

TEST(MixedPlaces, AnImageOrTwoAreNoPlace) {
  SceneDatabase scene(kTwoSides);
  AddOverlaid(&scene);
  std::vector<ImageId> asked = SideImages(0);
  asked.insert(asked.end(), {ImageId(5), ImageId(6)});
  EXPECT_TRUE(Find(&scene, asked).empty());
}

// The images of cameras [begin, end).
std::vector<ImageId> ImagesOf(uint32_t begin, uint32_t end) {
  std::vector<ImageId> images;
  for (uint32_t k = begin; k < end; ++k) images.push_back(ImageId(k + 1));
  return images;
}

// So many cameras, the second half of which is laid over the first one.
SceneOptions HalvesOf(uint32_t count) {
  SceneOptions options = kTwoSides;
  options.camera_count = count;
  return options;
}
void AddHalves(SceneDatabase* scene, uint32_t count) {
  scene->AddImages(0, count);
  std::vector<uint32_t> halves[2];
  for (uint32_t k = 0; k < count; ++k) halves[2 * k < count ? 0 : 1].push_back(k);
  Sim3 over;
  over.translation.x() = -kTwoSides.beside;
  AddOverlaid(scene, halves[0], halves[1], over);
}

TEST(MixedPlaces, PairsThatAgreeHoldAPlaceTogether) {
  SceneDatabase scene(HalvesOf(24));
  AddHalves(&scene, 24);
  std::vector<ImageId> asked = ImagesOf(0, 5);
  for (const ImageId id : ImagesOf(12, 17)) asked.push_back(id);
  EXPECT_EQ(Find(&scene, asked), ImagesOf(12, 24));
  // Between images of which one was not asked, pairs agree across.
  DoubtOptions wide;
  wide.mixed_agreeing_share_max = 0.5;
  EXPECT_TRUE(Find(&scene, asked, wide).empty());
}

TEST(MixedPlaces, MoreThanAreComparedAtOnceAreAskedInGroups) {
  SceneDatabase scene(HalvesOf(72));
  AddHalves(&scene, 72);
  EXPECT_EQ(Find(&scene, ImagesOf(0, 72)), ImagesOf(36, 72));
  EXPECT_TRUE(Find(&scene, ImagesOf(36, 72)).empty());
}

}  // namespace
}  // namespace veduta
