// SPDX-License-Identifier: Apache-2.0
#pragma once
// How far the poses of a reconstruction are from the truth.

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "storage/database.h"
#include "tests/engine/street_photos.h"

namespace veduta {

// How the poses of one reconstruction differ from the truth after the best similarity.
struct PoseErrors {
  size_t count = 0;
  double center_m_median = 0, center_m_max = 0, angle_deg_median = 0, angle_deg_max = 0;
};

// Of poses (cam_from_world) in the order of the true ones.
inline PoseErrors ComparePoses(const std::vector<Rigid3>& found, const std::vector<Rigid3>& truth) {
  PoseErrors errors;
  errors.count = found.size();
  if (found.size() < 3) return errors;
  Eigen::Matrix3Xd from(3, found.size()), to(3, found.size());
  for (size_t i = 0; i < found.size(); ++i) {
    from.col(static_cast<Eigen::Index>(i)) = found[i].Center();
    to.col(static_cast<Eigen::Index>(i)) = truth[i].Center();
  }
  // Centres on a line leave a turn about it open; a second point a camera, a metre ahead of it in
  // the truth's scale, does not. The scale comes from a first fit.
  const double scale = std::cbrt(Eigen::umeyama(from, to).topLeftCorner<3, 3>().determinant());
  Eigen::Matrix3Xd from_all(3, 2 * found.size()), to_all(3, 2 * found.size());
  for (size_t i = 0; i < found.size(); ++i) {
    const Eigen::Index k = 2 * static_cast<Eigen::Index>(i);
    from_all.col(k) = found[i].Center();
    to_all.col(k) = truth[i].Center();
    from_all.col(k + 1) = found[i].Inverse() * Eigen::Vector3d(0, 0, 1 / scale);
    to_all.col(k + 1) = truth[i].Inverse() * Eigen::Vector3d(0, 0, 1);
  }
  const Eigen::Matrix4d fit = Eigen::umeyama(from_all, to_all);
  const Eigen::Matrix3d turn =
      fit.topLeftCorner<3, 3>() / std::cbrt(fit.topLeftCorner<3, 3>().determinant());
  std::vector<double> centers_m, angles_deg;
  for (size_t i = 0; i < found.size(); ++i) {
    centers_m.push_back((fit.topLeftCorner<3, 3>() * found[i].Center() +
                         fit.topRightCorner<3, 1>() - truth[i].Center())
                            .norm());
    const Eigen::Quaterniond rotation = found[i].rotation * Eigen::Quaterniond(turn).conjugate();
    angles_deg.push_back(rotation.angularDistance(truth[i].rotation) * 180 / M_PI);
  }
  const auto middle = static_cast<std::ptrdiff_t>(found.size() / 2);
  std::sort(centers_m.begin(), centers_m.end());
  std::sort(angles_deg.begin(), angles_deg.end());
  errors.center_m_median = centers_m[static_cast<size_t>(middle)];
  errors.center_m_max = centers_m.back();
  errors.angle_deg_median = angles_deg[static_cast<size_t>(middle)];
  errors.angle_deg_max = angles_deg.back();
  return errors;
}

inline PoseErrors CompareWithTruth(const Snapshot& snapshot, ReconstructionId reconstruction,
                                   const std::vector<Stand>& stands) {
  std::vector<Rigid3> found, truth;
  for (const Stand& stand : stands) {
    const TakenPhoto& photo = TakePhoto(stand);
    const auto id = snapshot.FindImageByName(photo.name, "anna");
    if (!id.ok() || !*id) continue;
    const auto pose = snapshot.FindPose(**id);
    if (!pose.ok() || !*pose || (*pose)->reconstruction != reconstruction) continue;
    found.push_back((*pose)->cam_from_world);
    truth.push_back(photo.cam_from_world);
  }
  return ComparePoses(found, truth);
}

}  // namespace veduta
