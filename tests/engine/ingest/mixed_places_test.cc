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

// 12 cameras of each of two places, of which five each are asked.
struct AskedFew {
  SceneOptions options = kTwoSides;
  std::vector<uint32_t> first, second;
  std::vector<ImageId> asked, others;

  AskedFew() {
    options.camera_count = 24;
    for (uint32_t k = 0; k < 24; ++k) {
      (k < 12 ? first : second).push_back(k);
      if (k >= 12) others.push_back(ImageId(k + 1));
      if (k % 12 < 5) asked.push_back(ImageId(k + 1));
    }
  }
  void AddTo(SceneDatabase* scene) const {
    scene->AddImages(0, 24);
    Sim3 over;
    over.translation.x() = -options.beside;
    AddOverlaid(scene, first, second, over);
  }
};

TEST(MixedPlaces, PairsThatAgreeHoldAPlaceTogether) {
  const AskedFew few;
  SceneDatabase scene(few.options);
  few.AddTo(&scene);
  EXPECT_EQ(Find(&scene, few.asked), few.others);
  // Between images of which one was not asked, pairs agree across.
  DoubtOptions wide;
  wide.mixed_agreeing_share_max = 0.5;
  EXPECT_TRUE(Find(&scene, few.asked, wide).empty());
}

TEST(MixedPlaces, MoreThanAreComparedAtOnceAreAskedInGroups) {
  SceneOptions many = kTwoSides;
  many.camera_count = 72;
  SceneDatabase scene(many);
  scene.AddImages(0, 72);
  std::vector<uint32_t> first, second;
  std::vector<ImageId> all, others;
  for (uint32_t k = 0; k < 72; ++k) {
    (k < 36 ? first : second).push_back(k);
    all.push_back(ImageId(k + 1));
    if (k >= 36) others.push_back(ImageId(k + 1));
  }
  Sim3 over;
  over.translation.x() = -many.beside;
  AddOverlaid(&scene, first, second, over);
  EXPECT_EQ(Find(&scene, all), others);
  EXPECT_TRUE(Find(&scene, others).empty());
}

}  // namespace
}  // namespace veduta
