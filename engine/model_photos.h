// SPDX-License-Identifier: Apache-2.0
#pragma once
// Finds the photos that a model names.

#include <string>

#include "storage/base/status.h"

namespace veduta {

struct ModelPhotoFile {
  std::string name;  // relative to the folder
  std::string path;
};

// The photo of that name in the folder, which must be there. What lies outside of the folder is no
// photo of it, also where a name or a link leads there. In a name that no file has as it is, %XX
// stands for a byte, as in a URL. kNotFound, kInvalidArgument: for a person.
Result<ModelPhotoFile> FindModelPhoto(const std::string& folder, const std::string& name);

}  // namespace veduta
