// SPDX-License-Identifier: Apache-2.0
#pragma once
// Makes a reconstruction of stored photos whose poses came with a model of another program. Only
// the poses are taken from there, and as far as verified pairs agree with them: the points are
// triangulated anew.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/ingest/ingest_parts.h"
#include "engine/ingest/write_scope.h"
#include "storage/base/transform.h"
#include "storage/model/verdict.h"

namespace veduta {

struct ModelPose {
  ImageId image;  // each once
  Rigid3 cam_from_world;
};

// A photo that does not get the pose, and why, for a person.
struct RefusedPose {
  ImageId image;
  std::string why;
  Reason reason = Reason::kNone;  // where the photo waits for another pose now
};

struct ModelFounding {
  ReconstructionId reconstruction;  // not valid() where no three photos have got their poses
  uint64_t point_count = 0;
  std::vector<ImageId> placed;  // ascending
  std::vector<RefusedPose> refused;
};

// Writes and commits, with entries of the journal by `actor`. The reconstruction has the model's
// frame, unless what its pairs lead to is larger and takes it in. Its adjustment, which judges all
// of it, is due at once. Photos that have a pose already, or must not have one, are refused and
// stay as they are; those that verified pairs contradict, or too few points hold, wait to be tried
// again. Holds all features of the photos in memory. Deterministic in its inputs.
Result<ModelFounding> FoundByModel(const IngestParts& parts, std::span<const ModelPose> poses,
                                   const std::string& actor, WriteScope scope);

}  // namespace veduta
