// SPDX-License-Identifier: Apache-2.0
#pragma once
// COLMAP's text format: cameras.txt, images.txt and points3D.txt for every reconstruction.

#include <string>
#include <vector>

#include "storage/database.h"

namespace veduta {

struct ExportedModel {
  ReconstructionId reconstruction;
  std::string folder;
  uint64_t images = 0, points = 0;
};

// Writes OUT/0, OUT/1, ... largest reconstruction first (ties: lower id). Pixels are COLMAP's:
// (0.5, 0.5) is the centre of the top-left pixel. A camera whose distortion is centred on its
// principal point is exported as OPENCV with the photos' own pixels; one with another centre, which
// COLMAP cannot say, as PINHOLE with undistorted pixels. kAlreadyExists when OUT exists and is not
// empty; kIoError with the system's word.
Result<std::vector<ExportedModel>> ExportColmap(const Snapshot& snapshot, const std::string& out);

}  // namespace veduta
