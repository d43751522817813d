// SPDX-License-Identifier: Apache-2.0
#pragma once
// What goes through the door when a model of another program is taken in.

#include <cstdint>
#include <string>
#include <vector>

#include "storage/base/ids.h"

namespace veduta {

struct ImportRequest {
  // A folder with COLMAP's cameras, images and points3D, all three as .bin or all three as .txt.
  std::string model;
  // The folder that the names of the model's photos are relative to. Nothing outside of it is read,
  // wherever names and links point to.
  std::string photos;
  std::string contributor = "anonymous";  // who sends them, for the journal as well
};

// What has become of a photo of the model.
struct ImportedPhoto {
  std::string name;                 // in the model
  ImageId image;                    // valid where the photo is stored
  bool was_given_pose = false;      // by the model; afterwards it is doubted like any other
  ReconstructionId reconstruction;  // valid where it has a pose now, of whatever origin
  std::string why_not;              // otherwise: for a person
};

struct ImportAnswer {
  ReconstructionId reconstruction;    // that was made; not valid() where none was
  uint64_t points = 0;                // that it was made with
  std::vector<ImportedPhoto> photos;  // in the model's order: ascending numbers of COLMAP's
  std::vector<std::string> messages;  // for a person: what the city has not as the model has it
};

}  // namespace veduta
