// SPDX-License-Identifier: Apache-2.0
#pragma once
// Files for the measurements.

#include <string>
#include <vector>

#include "engine/camera/photo_decoder.h"

namespace veduta::floor {

std::vector<uint8_t> ReadBytes(const std::string& path);  // empty if it cannot be read

// Decoded as the engine does.
DecodedPhoto ReadPhoto(const std::string& path);

// The files given, and all files below the folders given whose names end as photos' do, in the
// order of their names.
std::vector<std::string> PhotosBelow(const std::vector<std::string>& paths);

}  // namespace veduta::floor
