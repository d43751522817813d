// SPDX-License-Identifier: Apache-2.0
#pragma once
// Records and keys of the offline pass as bytes; rules as in record_codec.h and keys.h.

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/dense.h"

namespace veduta {

// First byte of a key in `dense` and, for 2 and 3, in `depth`. Never renumbered.
enum class DenseEntry : uint8_t {
  kSettings = 1,      // reconstruction
  kDepth = 2,         // image
  kCheckedDepth = 3,  // image, version
  kTile = 4,          // reconstruction, place
};

std::string DenseSettingsKey(ReconstructionId reconstruction);
std::string DepthKey(ImageId image);
std::string CheckedDepthKey(ImageId image, uint64_t version);
std::string TilePrefix(ReconstructionId reconstruction);
std::string TileKey(ReconstructionId reconstruction, GridPlace place);
std::string VolumePrefix(ReconstructionId reconstruction);
std::string VolumePrefix(ReconstructionId reconstruction, GridPlace tile);
std::string VolumeKey(ReconstructionId reconstruction, GridPlace tile, uint8_t block);
std::string SurfacePrefix(SurfacePart part, ReconstructionId reconstruction);
std::string SurfaceKey(SurfacePart part, ReconstructionId reconstruction, GridPlace tile);

// What the key holds after its first byte; kCorruption when its length is wrong or an id is 0.
Status ParseDenseKey(std::string_view key, ReconstructionId* reconstruction);
Status ParseDenseKey(std::string_view key, ImageId* image);
Status ParseDenseKey(std::string_view key, ImageId* image, uint64_t* version);
Status ParseDenseKey(std::string_view key, ReconstructionId* reconstruction, GridPlace* place);

Result<std::string> Encode(const DenseSettings& settings);
Result<std::string> Encode(const DepthRecord& depth);
Result<std::string> Encode(const CheckedDepthRecord& depth);
Result<std::string> Encode(const DepthPixels& pixels);
Result<std::string> Encode(const TileRecord& tile);

// The ids of the record are set by the caller before.
Status Decode(std::string_view value, DenseSettings* settings);
Status Decode(std::string_view value, DepthRecord* depth);
Status Decode(std::string_view value, CheckedDepthRecord* depth);
Status Decode(std::string_view value, DepthPixels* pixels);
Status Decode(std::string_view value, TileRecord* tile);

}  // namespace veduta
