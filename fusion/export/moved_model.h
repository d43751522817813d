// SPDX-License-Identifier: Apache-2.0
#pragma once
// A model in another frame than its reconstruction's.

#include <memory>
#include <vector>

#include "fusion/surface/model_writer.h"
#include "storage/base/transform.h"

namespace veduta {

// A writer that hands on to `writer` what comes, moved by the similarity.
std::unique_ptr<ModelWriter> MoveModel(std::unique_ptr<ModelWriter> writer,
                                       const Sim3& to_from_world);

std::vector<ExportedCamera> MoveCameras(std::vector<ExportedCamera> cameras,
                                        const Sim3& to_from_world);

}  // namespace veduta
