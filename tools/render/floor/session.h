// SPDX-License-Identifier: Apache-2.0
#pragma once
// A calibration session: photos of one floor from all around, and their truth, in a folder.

#include <functional>
#include <string>
#include <vector>

#include "tools/render/floor/floor_photo.h"

namespace veduta::floor {

struct SessionOptions {
  FloorOptions floor;
  FloorPhotoOptions photo;  // its seed is mixed with the photo's number
  CameraModel model;
  uint32_t photos = 12;  // [1, 1000]
  // [0, 75]; the first photo looks nearly straight down, the others are tilted up to this.
  double tilt_deg_max = 55;
  double coverage = 0.8;  // [0.1, 5]; width of the floor seen, in diameters of the laid-out sheets
  double motion_px_max = 0;      // [0, 100]; each photo smeared by up to this, in any direction
  double blur_sigma_px_max = 0;  // [0, 20]; each photo is blurred by up to this more
  int jpeg_quality = 90;         // [1, 100]
  uint32_t threads = 1;          // [1, 256]; one photo per thread; the bytes do not depend on it
  std::string command;           // for the README: how to make the same again
  uint64_t seed = 1;             // of the poses

  Status Check() const;  // the first violated bound, named with its value
};

// A camera that looks at `target_m` on the floor from `distance_m`: `tilt_deg` off the vertical,
// standing in the direction `azimuth_deg` (from +x towards +y), turned about its axis by
// `roll_deg`.
Rigid3 LookDown(const Eigen::Vector2d& target_m, double distance_m, double tilt_deg,
                double azimuth_deg, double roll_deg);

// The session's cameras, named photo0001.jpg and so on. Deterministic. kInvalidArgument on bad
// options.
Result<std::vector<FloorCamera>> SessionCameras(const SessionOptions& options,
                                                double floor_extent_m);

// Photo `index` of the session as its JPEG will hold it before compression.
Result<cv::Mat> RenderSessionPhoto(const Floor& floor, const FloorCamera& camera,
                                   const SessionOptions& options, size_t index);

// Writes into a new or empty folder:
//   photos/NAME            grey JPEG
//   truth/NAME.camera      pose and intrinsics, as tools/render/street/truth_file.h has them
//   truth/NAME.markers     one line for each marker whose feature point is in the photo: id,
//                          u, v (px), its diameter (px), tilt (degrees), covered part of the ring,
//                          and 1 if all of it is in the photo
//   markers.txt            one line for each marker: id, its place in metres (x y z)
//   camera.txt             the intrinsics with the distortion
//   README                 how it was made
//
// `progress` is called as RenderStreet calls it. kInvalidArgument on bad options; kAlreadyExists if
// the folder is not empty; kIoError.
Status RenderSession(const SessionOptions& options, const std::string& folder,
                     const std::function<void(size_t)>& progress);

}  // namespace veduta::floor
