// SPDX-License-Identifier: Apache-2.0
#pragma once
// A model of COLMAP as far as an import needs it: https://colmap.github.io/format.html

#include <cstdint>
#include <string>
#include <vector>

#include "engine/camera/calibration/known_camera.h"
#include "storage/base/status.h"
#include "storage/base/transform.h"
#include "storage/model/camera.h"

namespace veduta {

struct ModelCamera {
  uint32_t id = 0;
  std::string lens;             // what COLMAP calls it
  CameraModel model;            // CheckCamera accepts it
  ConversionResidual residual;  // of ours from COLMAP's, over the photo
};

struct ModelImage {
  uint32_t id = 0;
  uint32_t camera = 0;  // the id of one that the model has
  // As the file has it: in text, a space may stand there as it is or, as we write it, as in a URL.
  std::string name;
  Rigid3 cam_from_world;  // of finite numbers; the rotation of unit length
  // Places, in the list of images, of earlier ones that share most points with this one, the most
  // first.
  std::vector<uint32_t> seen_with;
};

struct ColmapModel {
  std::vector<ModelCamera> cameras;  // ascending ids
  std::vector<ModelImage> images;    // ascending ids, each name once
  // What was taken from all positions of the file, in whole units: a model in coordinates of a map
  // lies far from where they begin, and single precision would lose metres of it. Zero for others.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
};

// Reads cameras, images and points3D in the folder: the .bin files where there is a cameras.bin,
// otherwise the .txt files. They are read piece by piece, so memory grows with the number of
// images, not with the files. kNotFound where the folder has no such files; kInvalidArgument names
// the file and what is wrong in it, or the camera whose lens ours cannot express; kIoError.
Result<ColmapModel> ReadColmapModel(const std::string& folder);

}  // namespace veduta
