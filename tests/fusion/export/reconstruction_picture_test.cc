// SPDX-License-Identifier: Apache-2.0
// Goal: a reconstruction is drawn through a photo's own camera: its points where the camera sees
//   them, its surface once there is one; what is not there is refused by name.
// Method: a street of a few photos in a real database. Each point is projected by hand and looked
//   for in the picture; a coarse dense pass then gives a surface, and gains to read.
#include "fusion/export/reconstruction_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "fusion/pass/dense_pass.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

constexpr uint32_t kSidePx = 128;
constexpr ReconstructionId kStreet{1};
constexpr ImageId kPhoto{2};

double CoveredShare(const Picture& picture) {
  const auto covered = std::ranges::count_if(picture.depth, [](float z) { return z > 0; });
  return static_cast<double>(covered) / static_cast<double>(picture.depth.size());
}

class ReconstructionPictureTest : public testing::Test {
 protected:
  void SetUp() override {
    city_.Add({{20.0, 90}, {20.7, 90}, {21.4, 90}, {22.1, 90}});
    city_.AddOne("letter.jpg", {'n', 'o', ' ', 'p', 'h', 'o', 't', 'o'});
  }

  std::shared_ptr<const Snapshot> snapshot() const { return city_.parts().database->GetSnapshot(); }
  ViewGeometry PhotoView() const {
    const auto view = PhotoGeometry(*snapshot(), kPhoto, kSidePx);
    EXPECT_OK(view);
    return view.ok() ? *view : ViewGeometry();
  }
  Result<Picture> Draw(Drawn drawn) const {
    return DrawReconstruction(*snapshot(), kStreet, drawn, PhotoView(), {}, *city_.parts().pool);
  }
  Result<DensifyReport> Densify() {
    DensifyOptions options;
    options.depth_side_px = 96;
    return RunDensePass({*city_.parts().writer, *city_.parts().pool, nullptr, {}, {}}, kStreet,
                        options);
  }

  City city_;
};

TEST_F(ReconstructionPictureTest, APhotosCameraHasItsPoseAndTheSizeAskedFor) {
  const ViewGeometry view = PhotoView();
  EXPECT_EQ(std::max(view.width_px, view.height_px), kSidePx);
  const auto pose = snapshot()->FindPose(kPhoto);
  ASSERT_TRUE(pose.ok() && *pose);
  EXPECT_TRUE(view.cam_from_world.translation == (*pose)->cam_from_world.translation);
  const auto whole = PhotoGeometry(*snapshot(), kPhoto, 0);
  ASSERT_OK(whole);
  EXPECT_GT(whole->width_px, 400u) << "nearly the 512 of the photo";
  EXPECT_NEAR(whole->camera.fx / whole->width_px, view.camera.fx / view.width_px, 0.02);
  const auto letter = city_.Ask().FindImage("letter.jpg");
  ASSERT_OK(letter);
  const Status unplaced = PhotoGeometry(*snapshot(), letter->id, kSidePx).status();
  EXPECT_EQ(unplaced.code(), StatusCode::kNotFound);
  EXPECT_NE(unplaced.message().find("letter.jpg has no pose"), std::string::npos);
}

TEST_F(ReconstructionPictureTest, PointsAreDrawnWhereTheCameraSeesThem) {
  const auto picture = Draw(Drawn::kPoints);
  ASSERT_OK(picture);
  const ViewGeometry view = PhotoView();
  ASSERT_EQ(picture->width_px, view.width_px);
  ASSERT_EQ(picture->height_px, view.height_px);
  const auto record = snapshot()->GetReconstruction(kStreet);
  ASSERT_OK(record);
  size_t seen = 0;
  const auto look_for = [&](const PointRecord& point) {
    const Eigen::Vector3d in_cam = view.cam_from_world * point.position;
    if (in_cam.z() <= 0) return;
    const Eigen::Vector2d x = view.camera.Project(in_cam);
    if (x.x() < 1 || x.y() < 1 || x.x() > view.width_px - 2 || x.y() > view.height_px - 2) return;
    const size_t at = static_cast<size_t>(std::lround(x.y())) * view.width_px +
                      static_cast<size_t>(std::lround(x.x()));
    ++seen;
    EXPECT_GT(picture->depth[at], 0) << "a point at " << x.transpose();
    EXPECT_LE(picture->depth[at], in_cam.z() * 1.0001) << "no farther than what lies there";
  };
  ASSERT_OK(
      snapshot()->ScanPointBlocks(kStreet, record->points_generation, [&](const PointBlock& block) {
        std::ranges::for_each(block.points, look_for);
        return true;
      }));
  EXPECT_GT(seen, 100u);
}

TEST_F(ReconstructionPictureTest, TheSurfaceIsDrawnOnceThereIsOne) {
  const auto points = Draw(Drawn::kPoints), instead = Draw(Drawn::kSurfaceOrPoints);
  ASSERT_OK(points);
  ASSERT_OK(instead);
  EXPECT_EQ(instead->rgb, points->rgb);
  ASSERT_OK(Densify());
  const auto surface = Draw(Drawn::kSurfaceOrPoints), still_points = Draw(Drawn::kPoints);
  ASSERT_OK(surface);
  ASSERT_OK(still_points);
  EXPECT_NE(surface->rgb, points->rgb);
  EXPECT_EQ(still_points->rgb, points->rgb);
  EXPECT_GT(CoveredShare(*surface), 0.3);
}

TEST_F(ReconstructionPictureTest, APhotoComesWithTheGainThatItWasBalancedBy) {
  const auto before = LoadBalancedPhoto(snapshot(), kPhoto, kSidePx);
  ASSERT_OK(before);
  EXPECT_EQ(before->gain, Eigen::Vector3f::Ones()) << "no dense pass has balanced it";
  EXPECT_EQ(before->view.geometry.width_px, PhotoView().width_px);
  ASSERT_OK(Densify());
  const auto depth = snapshot()->dense().FindDepth(kPhoto);
  ASSERT_TRUE(depth.ok() && *depth);
  const auto after = LoadBalancedPhoto(snapshot(), kPhoto, kSidePx);
  ASSERT_OK(after);
  for (int c = 0; c < 3; ++c) {
    EXPECT_GT(after->gain[c], 0);
    EXPECT_EQ(after->gain[c], (*depth)->gain[static_cast<size_t>(c)]);
  }
}

}  // namespace
}  // namespace veduta
