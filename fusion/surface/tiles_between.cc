// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/tiles_between.h"

#include <algorithm>

namespace veduta {

// A box is outside where all its corners are behind one of the frustum's planes; all go through the
// camera's centre.
bool MaySee(const ViewGeometry& view, const Eigen::AlignedBox3d& box) {
  if (box.isEmpty()) return false;
  const Eigen::Vector2d low = view.camera.Normalize(Eigen::Vector2d(-0.5, -0.5));
  const Eigen::Vector2d high =
      view.camera.Normalize(Eigen::Vector2d(view.width_px - 0.5, view.height_px - 0.5));
  const Eigen::Vector3d inward[5] = {
      {1, 0, -low.x()}, {-1, 0, high.x()}, {0, 1, -low.y()}, {0, -1, high.y()}, {0, 0, 1}};
  uint32_t reached = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d x =
        view.cam_from_world * box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner));
    for (int i = 0; i < 5; ++i) reached |= (inward[i].dot(x) >= 0 ? 1u : 0u) << i;
  }
  return reached == 31;
}

// The hull is the union over t in [0, 1] of the target shrunk by t towards the centre c: on each
// axis the interval [c + t (low - c), c + t (high - c)]. That meets [box low, box high] where t
// (low - c) <= box high - c and t (high - c) >= box low - c; both are half-lines of t, and axes are
// independent.
bool MeetsHull(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& center,
               const Eigen::AlignedBox3d& target) {
  double t_low = 0, t_high = 1;
  const auto at_most = [&](double slope, double bound) {  // t * slope <= bound
    if (slope > 0) {
      t_high = std::min(t_high, bound / slope);
    } else if (slope < 0) {
      t_low = std::max(t_low, bound / slope);
    } else if (bound < 0) {
      t_high = -1;
    }
  };
  for (int axis = 0; axis < 3; ++axis) {
    const double c = center[axis];
    at_most(target.min()[axis] - c, box.max()[axis] - c);
    at_most(c - target.max()[axis], c - box.min()[axis]);
  }
  return t_low <= t_high;
}

std::vector<uint32_t> TilesBetween(std::span<const Eigen::AlignedBox3d> boxes,
                                   const Eigen::AlignedBox3d& target,
                                   std::span<const Eigen::Vector3d> centers) {
  std::vector<uint32_t> between;
  for (size_t i = 0; i < boxes.size(); ++i) {
    const auto meets = [&](const Eigen::Vector3d& center) {
      return MeetsHull(boxes[i], center, target);
    };
    if (!boxes[i].isEmpty() && std::any_of(centers.begin(), centers.end(), meets)) {
      between.push_back(static_cast<uint32_t>(i));
    }
  }
  return between;
}

}  // namespace veduta
