// SPDX-License-Identifier: Apache-2.0
#pragma once
// Records as values. What a record's key says (its ids) is not in the value: the caller of Decode
// gives it. All functions are pure and thread-safe; equal records give equal bytes.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

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

// kInvalidArgument when the record breaks an invariant (storage/record_check.h).
Result<std::string> Encode(const DatabaseState& state);
Result<std::string> Encode(const CameraRecord& camera);
Result<std::string> Encode(const ImageRecord& image);
Result<std::string> Encode(const Features& features);
Result<std::string> Encode(const PairRecord& pair);
Result<std::string> Encode(const PairNeighbor& neighbor);
Result<std::string> Encode(const ReconstructionRecord& reconstruction);
Result<std::string> Encode(const PoseRecord& pose);
Result<std::string> Encode(std::span<const Observation> observations);
Result<std::string> Encode(const PointBlock& block);
Result<std::string> Encode(const JournalRecord& journal);
// Raw arrays, without a message around them.
Result<std::string> EncodeWords(std::span<const WordId> words);
Result<std::string> EncodeImages(std::span<const ImageId> images);
std::string EncodeU32(uint32_t value);

// kCorruption when the value is no message of its kind, is cut short, or breaks an invariant. The
// record is then in an unspecified state. Allocates no more than a small multiple of the value's
// size.
Status Decode(std::string_view value, DatabaseState* state);
Status Decode(std::string_view value, CameraId id, CameraRecord* camera);
Status Decode(std::string_view value, ImageId id, ImageRecord* image);
Status Decode(std::string_view value, Features* features);
Status Decode(std::string_view value, ImageId a, ImageId b, PairRecord* pair);
Status Decode(std::string_view value, ImageId image, PairNeighbor* neighbor);
Status Decode(std::string_view value, ReconstructionId id, ReconstructionRecord* reconstruction);
Status Decode(std::string_view value, ImageId image, PoseRecord* pose);
Status Decode(std::string_view value, std::vector<Observation>* observations);
Status Decode(std::string_view value, ImageId home, PointBlock* block);
Status Decode(std::string_view value, uint64_t sequence, JournalRecord* journal);
Status DecodeWords(std::string_view value, std::vector<WordId>* words);
Status DecodeImages(std::string_view value, std::vector<ImageId>* images);
Status DecodeU32(std::string_view value, uint32_t* number);

}  // namespace veduta
