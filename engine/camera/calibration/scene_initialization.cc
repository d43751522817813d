// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/calibration/scene_initialization.h"

#include <Eigen/Dense>
#include <algorithm>

#include "engine/camera/calibration/distortion_estimation.h"
#include "engine/camera/calibration/distortion_inversion.h"
#include "engine/camera/calibration/focal_search.h"
#include "engine/camera/projection.h"

namespace veduta {
namespace {

constexpr size_t kViewsMin = 3;  // two views of one plane leave the focal length open
// What is allowed once the lens is undone, ImageUnits. Chosen by hand; not measured.
constexpr double kNarrowErrorMax = 0.006;
constexpr double kNarrowLossScale = 0.001;

std::vector<PlanarView> Undistort(std::vector<PlanarView> views,
                                  const InverseDistortion& distortion) {
  for (PlanarView& view : views) {
    for (PlanarPoint& p : view) p.x = distortion.Undistort(p.x);
  }
  return views;
}

Status TooFewJoined(size_t joined, size_t views) {
  return Status::InvalidArgument(
      "calibration: only " + std::to_string(joined) + " of " + std::to_string(views) +
      " photos have enough points in common that lie on one plane (8 for each with another; at "
      "least 3 photos): take "
      "more photos, each showing most of the sheets, and do not move the sheets in between");
}

}  // namespace

std::vector<std::vector<Eigen::Matrix3d>> HomographiesFromReferences(const ViewTree& tree,
                                                                     size_t references) {
  std::vector<std::vector<Eigen::Matrix3d>> from;
  for (size_t r = 0; r < std::min(references, tree.order.size()); ++r) {
    const Eigen::Matrix3d root_from_reference = tree.ViewFromRoot(tree.order[r]).inverse();
    std::vector<Eigen::Matrix3d>& others = from.emplace_back();
    for (const uint32_t v : tree.order) {
      if (v == tree.order[r]) continue;
      const Eigen::Matrix3d h = tree.ViewFromRoot(v) * root_from_reference;
      others.push_back(h / h.norm());
    }
  }
  return from;
}

Result<InitialScene> InitializeScene(const PlanarViews& planar, ImageSize size) {
  // The tree is grown twice. The first one leaves room for what the lens bends. The second one is
  // of points that are undistorted already, so that it may join views that the lens kept apart.
  ViewTree tree = GrowViewTree(planar.views);
  if (tree.order.size() < kViewsMin) return TooFewJoined(tree.order.size(), planar.views.size());
  VEDUTA_ASSIGN_OR_RETURN(DistortionEstimate lens, EstimateDistortion(planar.views, {}, &tree));
  ViewTreeOptions narrow;
  narrow.error_max = kNarrowErrorMax;
  ViewTree narrow_tree = GrowViewTree(Undistort(planar.views, lens.distortion), narrow);
  if (narrow_tree.order.size() >= tree.order.size()) {
    tree = std::move(narrow_tree);
    DistortionOptions options;
    options.loss_scale = kNarrowLossScale;
    options.start = lens.distortion;
    VEDUTA_ASSIGN_OR_RETURN(lens, EstimateDistortion(planar.views, options, &tree));
  }

  InitialScene scene;
  scene.distortion = lens.distortion;
  const auto focal = SearchFocalLength(HomographiesFromReferences(tree, kFocalReferences));
  VEDUTA_CHECK(focal.has_value(),
               "a tree of " + std::to_string(tree.order.size()) + " views has homographies");
  scene.focal_px = focal->focal * planar.units.unit_px;
  scene.normals_disagree_deg = focal->disagreement_deg;
  scene.metric = InitializeMetric(Undistort(planar.views, lens.distortion), tree, focal->focal);

  CameraModel pinhole;
  pinhole.width_px = size.width_px;
  pinhole.height_px = size.height_px;
  pinhole.fx = pinhole.fy = scene.focal_px;
  pinhole.cx = planar.units.center_px.x();
  pinhole.cy = planar.units.center_px.y();
  ConversionResidual residual;
  scene.camera = InvertDistortion(lens.distortion, planar.units, pinhole, &residual);
  if (!CheckCamera(scene.camera).ok()) {
    // Points that all lie near the centre may give a distortion that folds the corners over. The
    // adjustment then starts without any.
    scene.camera = pinhole;
    scene.camera.u0 = pinhole.cx;
    scene.camera.v0 = pinhole.cy;
  }
  return scene;
}

}  // namespace veduta
