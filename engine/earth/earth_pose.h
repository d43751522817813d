// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where cameras are on the earth, by the place of their reconstruction.

#include <Eigen/Core>

#include "engine/door/answers.h"
#include "engine/door/earth.h"
#include "storage/base/transform.h"
#include "storage/model/earth.h"

namespace veduta {

// The lower triangle, row by row, as records keep it; and back.
std::array<double, 28> PackCovariance(const Eigen::Matrix<double, 7, 7>& covariance);
Eigen::Matrix<double, 7, 7> UnpackCovariance(const std::array<double, 28>& rows);

// How far a point may be off by the place of its reconstruction: covariance along east, north and
// up of the origin, m^2.
Eigen::Matrix3d PositionCovariance(const EarthPlace& place, const Eigen::Vector3d& world);

// Its standard deviations are by the place alone.
EarthPose EarthPoseOf(const EarthPlace& place, uint32_t version, const Rigid3& cam_from_world);

// Adds what the pose may be off by within its reconstruction to the standard deviations of the
// pose on the earth.
void AddUncertainty(const EarthPlace& place, const PoseUncertainty& uncertainty, EarthPose* pose);

// What the covariance says of the place as a whole.
EarthAnswer EarthAnswerOf(const Georeference& georeference);

}  // namespace veduta
