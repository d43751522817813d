// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where an exported model is on the earth.

#include <string>

#include "engine/door/dense.h"
#include "storage/model/reconstruction.h"

namespace veduta {

// Whether the model is written in metres on the earth.
bool IsOnEarth(const ReconstructionRecord& record, const ExportRequest& request);
// The frame that the model is written in from the reconstruction's; the same where it is not.
Sim3 ModelFromWorld(const ReconstructionRecord& record, const ExportRequest& request);

// Writes nothing where the place is not known. Otherwise a JSON object: `origin` (latitude,
// longitude, height; WGS 84); `scale`, `rotation_wxyz` and `translation` of x_enu = scale R x_model
// + translation, metres to the east, the north and above the origin; `version`.
Status WriteEarthFile(const ReconstructionRecord& record, const ExportRequest& request,
                      const std::string& path);

}  // namespace veduta
