// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/orders/truth_folder.h"

#include <algorithm>
#include <filesystem>
#include <fstream>

namespace veduta::orders {
namespace {

namespace fs = std::filesystem;

constexpr int kNumbersBeforeRotation = 12;
constexpr double kOrthonormalTolerance = 1e-3;  // Strecha's files have six digits

Result<Rigid3> ReadCamera(const std::string& path) {
  std::ifstream file(path);
  if (!file) return Status::IoError("cannot read " + path);
  double values[kNumbersBeforeRotation + 12];
  for (double& value : values) {
    if (!(file >> value))
      return Status::Corruption(path + " is not a camera file: 24 numbers expected");
  }
  const Eigen::Matrix3d world_from_cam =
      Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(values + kNumbersBeforeRotation);
  const Eigen::Vector3d center(values[21], values[22], values[23]);
  const Eigen::Matrix3d product = world_from_cam * world_from_cam.transpose();
  if (!((product - Eigen::Matrix3d::Identity()).norm() < kOrthonormalTolerance) ||
      world_from_cam.determinant() < 0 || !center.allFinite()) {
    return Status::Corruption(path + " holds a matrix that is no rotation");
  }
  Rigid3 cam_from_world;
  cam_from_world.rotation =
      Eigen::Quaterniond(Eigen::Matrix3d(world_from_cam.transpose())).normalized();
  cam_from_world.translation = -(cam_from_world.rotation * center);
  return cam_from_world;
}

}  // namespace

Result<Truth> ReadTruth(const std::string& folder) {
  std::error_code error;
  Truth truth;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    if (at->path().extension() != ".camera") continue;
    VEDUTA_ASSIGN_OR_RETURN(const Rigid3 camera, ReadCamera(at->path().string()));
    truth.emplace(at->path().stem().string(), camera);
  }
  if (error) return Status::IoError("cannot read " + folder + ": " + error.message());
  if (truth.size() < 3) {
    return Status::NotFound(folder + " holds " + std::to_string(truth.size()) +
                            " files NAME.camera, and three are needed");
  }
  return truth;
}

double ExtentOf(const Truth& truth) {
  double extent = 0;
  for (const auto& [name, camera] : truth) {
    for (const auto& [other_name, other] : truth)
      extent = std::max(extent, (camera.Center() - other.Center()).norm());
  }
  return extent;
}

}  // namespace veduta::orders
