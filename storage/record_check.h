// SPDX-License-Identifier: Apache-2.0
#pragma once
// What must hold of a record by itself. Checked before a record is written and after it is read: a
// value that could not be read back is never stored, and a damaged one is never handed out.

#include <cstdint>
#include <span>
#include <string_view>

#include "storage/base/status.h"
#include "storage/database.h"
#include "storage/model/camera.h"
#include "storage/model/features.h"
#include "storage/model/image.h"
#include "storage/model/journal.h"
#include "storage/model/pair.h"
#include "storage/model/points.h"
#include "storage/model/reconstruction.h"
#include "storage/model/state.h"

namespace veduta {

// kInvalidArgument naming the field and its value. Linear in the record's size.
Status Check(const DatabaseState& state);
Status Check(const CameraRecord& camera);
Status Check(const ImageRecord& image);
Status Check(const Features& features);
Status Check(const PairRecord& pair);
Status Check(const PairNeighbor& neighbor);
Status Check(const ReconstructionRecord& reconstruction);
Status Check(const PoseRecord& pose);
Status Check(std::span<const Observation> observations);
Status Check(const PointBlock& block);
Status Check(const JournalRecord& journal);
// Ascending, each once; ids of images must be valid too.
Status CheckWords(std::span<const WordId> words);
Status CheckImages(std::span<const ImageId> images);

}  // namespace veduta
