// SPDX-License-Identifier: Apache-2.0
#include "fusion/pass/range_images.h"

#include <cmath>

#include "fusion/depth/depth_codes.h"

namespace veduta {

ViewGeometry GeometryOf(const CheckedDepthRecord& depth) {
  ViewGeometry geometry{depth.width_px, depth.height_px, {}, depth.cam_from_world};
  geometry.camera.fx = depth.fx, geometry.camera.fy = depth.fy;
  geometry.camera.cx = depth.cx, geometry.camera.cy = depth.cy;
  return geometry;
}

bool MaySeeTile(const ViewGeometry& view, double far, GridPlace tile, const VolumeGrid& grid) {
  const double side = kTileSide * grid.voxel_size, radius = side * std::sqrt(0.75);
  const Eigen::Vector3d middle = Eigen::Vector3d(tile.x + 0.5, tile.y + 0.5, tile.z + 0.5) * side;
  const Eigen::Vector3d x = view.cam_from_world * middle;
  if (x.z() < -radius || x.z() - radius > far + grid.truncation()) return false;
  // The frustum's sides pass through the centre; normals point inwards.
  const Eigen::Vector2d low = view.camera.Normalize(Eigen::Vector2d(-0.5, -0.5));
  const Eigen::Vector2d high =
      view.camera.Normalize(Eigen::Vector2d(view.width_px - 0.5, view.height_px - 0.5));
  const Eigen::Vector3d normals[] = {
      {1, 0, -low.x()}, {-1, 0, high.x()}, {0, 1, -low.y()}, {0, -1, high.y()}};
  for (const Eigen::Vector3d& normal : normals) {
    if (normal.dot(x) < -radius * normal.norm()) return false;
  }
  return true;
}

Result<std::shared_ptr<const RangeImage>> RangeImages::Get(ImageId image, uint64_t version) {
  const auto load = [&]() -> Result<std::shared_ptr<const RangeImage>> {
    const DenseReader& dense = snapshot_->dense();
    VEDUTA_ASSIGN_OR_RETURN(const CheckedDepthRecord depth, dense.GetCheckedDepth(image, version));
    VEDUTA_ASSIGN_OR_RETURN(const DepthPixels pixels, dense.GetCheckedDepthPixels(image, version));
    VEDUTA_ASSIGN_OR_RETURN(const DepthMap map, DecodeDepth(pixels, depth.width_px, depth.height_px,
                                                            {depth.depth_near, depth.depth_far}));
    VEDUTA_ASSIGN_OR_RETURN(RangeImage made, RangeImage::Make(map, GeometryOf(depth)));
    return std::make_shared<const RangeImage>(std::move(made));
  };
  return images_.GetOrMake(version, load, [](const auto& image) { return image->size_bytes(); });
}

}  // namespace veduta
