// SPDX-License-Identifier: Apache-2.0
#pragma once
// A calibration session of known truth, points only: printed sheets somewhere on a floor, a camera
// with distortion, and what the detection of the markers would tell.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "engine/camera/calibration/observations.h"
#include "storage/base/transform.h"
#include "storage/model/camera.h"

namespace veduta {

struct SessionOptions {
  ImageSize size = {2272, 1704};
  double focal_per_width = 1.2;  // 0.6 to 2.5 in the experiment
  // How far the term of r^2 moves a corner, over the corner's radius; -0.15 is strong.
  double distortion_at_corner = -0.05;
  double second_share = -0.2;       // the term of r^4 over the term of r^2, at the corner
  double principal_offset = 0.02;   // of the principal point: up to this share of the width
  double distortion_offset = 0.03;  // of the centre of distortion: up to this share of the width
  uint32_t photo_count = 12;
  double noise_px = 0.1;                        // standard deviation of each coordinate
  double tilt_deg_min = 10, tilt_deg_max = 55;  // of the optical axis against the floor's normal
  double distance_ratio = 1.8;                  // farthest photo over nearest
  double sheet_height_mm = 2;                   // how far the sheets bulge and lift off the floor
  double missed_share = 0.1;                    // of the visible markers
  uint64_t seed = 1;
};

struct SyntheticSession {
  CameraModel truth;
  std::vector<Eigen::Vector3d> points;  // metres; the floor is z = 0; marker id is the index
  std::vector<Rigid3> cams_from_world;
  CalibrationInput input;
};

// 96 markers on 16 A4 sheets of 6 in a rough 4 by 4 layout, each turned and shifted; photos from
// all around that look near the middle. Deterministic in the options.
SyntheticSession MakeSession(const SessionOptions& options);

// The options of session `index` of the experiment: sizes, focal lengths from 0.6 to 2.5 of
// the width, 8 to 20 photos, mild to strong distortion of either sign, noise of 0.05 to 0.3 px.
SessionOptions ExperimentOptions(uint32_t index);

// A session as nobody should take it: few photos, little tilt, hardly any change of distance, many
// markers missed, much noise; some have misread ids and a sheet that moved. A calibration must say
// what such a session leaves open.
SyntheticSession MakePoorSession(uint32_t index);

// The largest difference, over a grid of the photo, between the displacements that two models undo;
// px.
double LargestDistortionError(const CameraModel& model, const CameraModel& truth);

}  // namespace veduta
