// SPDX-License-Identifier: Apache-2.0
// Goal: of what a view must see, only what nothing can hide from it is asked: what images on both
//   sides of it see, or what is no farther away than what it sees itself. And where other photos do
//   not find what they must see, as a sign that was lit for some, the view need not.
// Method: a synthetic scene whose points have descriptors of their own, seen by a view between two
//   cameras, beside them, and with a wall that it sees behind the points.
#include "engine/mapping/sure_visibility.h"

#include <gtest/gtest.h>

#include "synthetic_scene.h"

namespace veduta {
namespace {

constexpr SceneOptions kDense{.camera_count = 6, .point_count = 2000};

class SureVisibility : public testing::Test {
 protected:
  // A map of these cameras alone.
  void Place(const std::vector<uint32_t>& cameras) {
    for (const uint32_t k : cameras) map_.PlaceImage(scene_.images[k]);
    for (uint32_t i = 0; i < scene_.points.size(); ++i) {
      std::vector<TrackElement> track;
      for (const uint32_t k : cameras) {
        if (scene_.feature_of[k][i] >= 0)
          track.push_back(
              {scene_.images[k].id, static_cast<FeatureIndex>(scene_.feature_of[k][i])});
      }
      if (track.size() >= 2)
        points_.push_back(map_.AddPoint(track[0].image, scene_.points[i], track));
    }
  }
  VisibleStructure All(uint32_t view) const {
    return FindVisible(map_, scene_.images[view], {}, points_, {});
  }
  VisibleStructure Sure(const MapImage& view, std::span<const SeenDepth> seen = {}) const {
    return FindSurelyVisible(map_, view, seen, points_, {});
  }

  const SyntheticScene scene_ = MakeScene(kDense);
  CityMap map_;
  std::vector<PointId> points_;
};

TEST_F(SureVisibility, WhatImagesOnBothSidesSeeIsAsked) {
  Place({1, 3});
  const VisibleStructure sure = Sure(scene_.images[2]);
  EXPECT_GT(sure.expected, 0.9 * All(2).expected);
  EXPECT_GT(sure.found, 0.99 * sure.expected);
  EXPECT_EQ(sure.missing_cells, 0u);
}

TEST_F(SureVisibility, WhatImagesOnOneSideSeeIsNot) {
  Place({0, 1});
  ASSERT_GT(All(2).expected, 500u);
  EXPECT_LT(Sure(scene_.images[2]).expected, 0.1 * All(2).expected);
}

TEST_F(SureVisibility, WhatIsNoFartherThanTheViewSeesIsAsked) {
  Place({0, 1});
  const MapImage& view = scene_.images[2];
  double farthest = 0;
  for (const PointId id : points_)
    farthest = std::max(farthest, (view.cam_from_world * map_.point(id).position).z());
  // A wall on the left half of the picture.
  std::vector<SeenDepth> wall;
  for (double y = 2; y < view.height_px; y += 8) {
    for (double x = 2; x < view.width_px / 2.0; x += 8) wall.push_back({{x, y}, farthest});
  }
  const uint32_t all = All(2).expected, sure = Sure(view, wall).expected;
  EXPECT_GT(sure, all / 4);
  EXPECT_LT(sure, 3 * all / 4);
}

TEST_F(SureVisibility, AWrongPoseLacksIt) {
  Place({0, 1, 3, 4});
  MapImage shifted = scene_.images[2];
  shifted.cam_from_world.translation.x() -= 0.5;
  EXPECT_GT(Sure(shifted).cells, 20u);
  EXPECT_GT(Sure(shifted).missing_share(), 0.9);
}

// The image as it would be if what falls on its left half looked quite different.
MapImage WithoutLeftHalf(const MapImage& image) {
  auto changed = std::make_shared<Features>(*image.features);
  for (size_t i = 0; i < changed->size(); ++i) {
    if (changed->keypoints[i].x_px < image.width_px / 2.0f)
      std::fill_n(changed->descriptors.begin() + static_cast<ptrdiff_t>(i * kDescriptorSize),
                  kDescriptorSize, uint8_t{0});
  }
  MapImage without = image;
  without.features = std::move(changed);
  return without;
}

TEST_F(SureVisibility, WhatOtherPhotosDoNotFindIsNotAsked) {
  Place({0, 1});
  const MapImage view = WithoutLeftHalf(scene_.images[2]);
  const std::vector<ImageId> others = {ImageId(1), ImageId(2), ImageId(4), ImageId(5)};
  const VisibleStructure all = FindVisible(map_, view, {}, points_, {});
  ASSERT_GT(all.missing_cells, 10u);
  // The others lack it as well.
  for (const uint32_t k : {3, 4}) map_.PlaceImage(WithoutLeftHalf(scene_.images[k]));
  const VisibleStructure usual = FindUsuallySeen(map_, view, {}, points_, others, {});
  EXPECT_LT(usual.missing_cells, 3u) << "beside the middle, where half a cell is there";
  EXPECT_GT(usual.cells, 10u);
}

TEST_F(SureVisibility, WhatOtherPhotosFindIsAsked) {
  Place({0, 1});
  const MapImage view = WithoutLeftHalf(scene_.images[2]);
  const std::vector<ImageId> others = {ImageId(1), ImageId(2), ImageId(4), ImageId(5)};
  const VisibleStructure all = FindVisible(map_, view, {}, points_, {});
  for (const uint32_t k : {3, 4}) map_.PlaceImage(scene_.images[k]);
  const VisibleStructure usual = FindUsuallySeen(map_, view, {}, points_, others, {});
  EXPECT_EQ(usual.missing_cells, all.missing_cells);
  EXPECT_EQ(usual.cells, all.cells);
}

}  // namespace
}  // namespace veduta
