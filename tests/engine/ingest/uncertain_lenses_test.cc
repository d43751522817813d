// SPDX-License-Identifier: Apache-2.0
// Goal: focal lengths that photos have told are not known well where few images of their camera are
//   there, or their reconstruction is young; those that somebody has given are.
// Method: synthetic scenes in a database, with a camera of either kind.
#include "engine/ingest/uncertain_lenses.h"

#include <gtest/gtest.h>

#include <optional>

#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

std::vector<uint32_t> Range(uint32_t begin, uint32_t end) {
  std::vector<uint32_t> range;
  for (uint32_t i = begin; i < end; ++i) range.push_back(i);
  return range;
}

std::set<ImageId> Ids(uint32_t count) {
  std::set<ImageId> ids;
  for (uint32_t i = 1; i <= count; ++i) ids.insert(ImageId(i));
  return ids;
}

class UncertainLenses : public testing::Test {
 protected:
  UncertainLenses() : scene_({.camera_count = 14, .point_count = 400}) { scene_.AddImages(0, 14); }

  void SetRefinable(bool is_refinable) {
    CameraRecord camera = *scene_.Snap()->GetCamera(SceneDatabase::ImageCamera());
    camera.is_refinable = is_refinable;
    const auto transaction = scene_.database()->BeginTransaction();
    transaction->PutCamera(camera);
    ASSERT_OK(transaction->Commit());
  }

  // Of all images of the reconstruction, which is loaded.
  std::set<ImageId> YoungOf(ReconstructionId id) {
    work_.emplace(&scene_);
    std::vector<ImageId> images;
    EXPECT_OK(work_->loader.LoadReconstruction(id, &images));
    EXPECT_EQ(images.size(), 13u);
    return *ListYoungLenses(&work_->loader, work_->map, {images.begin(), images.end()});
  }

  SceneDatabase scene_;
  std::optional<SceneWork> work_;
};

TEST_F(UncertainLenses, FewImagesOfOneCameraDoNotKnowIt) {
  SetRefinable(true);
  EXPECT_EQ(*ListUncertainLenses(*scene_.Snap(), Ids(11)), Ids(11));
  EXPECT_TRUE(ListUncertainLenses(*scene_.Snap(), Ids(12))->empty());
  SetRefinable(false);
  EXPECT_TRUE(ListUncertainLenses(*scene_.Snap(), Ids(11))->empty());
}

TEST_F(UncertainLenses, ThoseOfAYoungReconstructionAreNotKnown) {
  const ReconstructionId id = scene_.AddReconstruction(Range(0, 13));
  SetRefinable(true);
  EXPECT_EQ(YoungOf(id), Ids(13));

  // One that is being founded, and a photo that is being added, are not stored yet.
  const ImageId last(13), added(99);
  MapImage fresh = work_->map.image(last);
  fresh.id = added;
  fresh.reconstruction = ReconstructionId(7);
  fresh.points.assign(fresh.points.size(), PointId{});
  work_->map.PlaceImage(fresh);
  EXPECT_EQ(*ListYoungLenses(&work_->loader, work_->map, {last, added}), std::set{last});

  ReconstructionRecord old = *scene_.Snap()->GetReconstruction(id);
  old.image_count = 100;
  const auto transaction = scene_.database()->BeginTransaction();
  transaction->PutReconstruction(old);
  ASSERT_OK(transaction->Commit());
  EXPECT_TRUE(YoungOf(id).empty());
}

TEST_F(UncertainLenses, AGivenCameraIsKnownEverywhere) {
  const ReconstructionId id = scene_.AddReconstruction(Range(0, 13));
  SetRefinable(false);
  EXPECT_TRUE(YoungOf(id).empty());
}

TEST_F(UncertainLenses, RotationsOfPairsMayDifferByMoreThere) {
  const AgreementOptions known;
  const AgreementOptions uncertain = OfUncertainLenses(known);
  EXPECT_EQ(uncertain.rotation_deg_max, 4 * known.rotation_deg_max);
  EXPECT_EQ(uncertain.rotation_px_max, 4 * known.rotation_px_max);
  EXPECT_EQ(uncertain.line_error_px_max, known.line_error_px_max);
}

}  // namespace
}  // namespace veduta
