// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the dense pass keeps: depth maps, histograms of signed distances, surfaces. Each artefact
// has a version, a hash of everything that it was computed from; what has the version that it would
// get again is not computed again. Small records lie apart from pixels, voxels and triangles, so
// that looking for work reads little.

#include <array>
#include <compare>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "storage/base/ids.h"
#include "storage/base/status.h"
#include "storage/model/dense.h"

namespace veduta {

class PinnedBytes;

class DenseReader {
 public:
  virtual ~DenseReader() = default;

  virtual Result<std::optional<DenseSettings>> FindSettings(
      ReconstructionId reconstruction) const = 0;
  virtual Result<std::vector<DenseSettings>> ListSettings() const = 0;  // ascending reconstructions

  virtual Result<std::optional<DepthRecord>> FindDepth(ImageId image) const = 0;
  virtual Status ScanDepths(
      const std::function<bool(const DepthRecord&)>& visit) const = 0;  // ascending images
  virtual Result<DepthPixels> GetDepthPixels(ImageId image) const = 0;

  virtual Result<CheckedDepthRecord> GetCheckedDepth(ImageId image, uint64_t version) const = 0;
  // Ascending images, then versions: superseded ones stay until no tile names them.
  virtual Status ScanCheckedDepths(
      const std::function<bool(const CheckedDepthRecord&)>& visit) const = 0;
  virtual Result<DepthPixels> GetCheckedDepthPixels(ImageId image, uint64_t version) const = 0;

  virtual Result<std::optional<TileRecord>> FindTile(ReconstructionId reconstruction,
                                                     GridPlace place) const = 0;
  // Ascending places.
  virtual Status ScanTiles(ReconstructionId reconstruction,
                           const std::function<bool(const TileRecord&)>& visit) const = 0;
  // kNotFound where it is not allocated.
  virtual Result<PinnedBytes> GetVolumeBlock(ReconstructionId reconstruction, GridPlace tile,
                                             uint8_t block) const = 0;
  virtual Result<PinnedBytes> GetSurface(SurfacePart part, ReconstructionId reconstruction,
                                         GridPlace tile) const = 0;

  // Every key and value of the pass, for the digest: family's number, key, value.
  virtual Status ScanAll(
      const std::function<void(uint8_t family, std::span<const uint8_t> key,
                               std::span<const uint8_t> value)>& visit) const = 0;
};

class DenseWriter {
 public:
  virtual ~DenseWriter() = default;

  virtual void PutSettings(const DenseSettings& settings) = 0;
  virtual void PutDepth(const DepthRecord& depth) = 0;  // the record alone
  virtual void PutDepthPixels(ImageId image, const DepthPixels& pixels) = 0;
  virtual void DeleteDepth(ImageId image) = 0;  // record and pixels
  virtual void PutCheckedDepth(const CheckedDepthRecord& depth, const DepthPixels& pixels) = 0;
  virtual void DeleteCheckedDepth(ImageId image, uint64_t version) = 0;
  virtual void PutTile(const TileRecord& tile) = 0;
  virtual void PutVolumeBlock(ReconstructionId reconstruction, GridPlace tile, uint8_t block,
                              std::span<const uint8_t> bytes) = 0;
  virtual void DeleteVolumeBlock(ReconstructionId reconstruction, GridPlace tile,
                                 uint8_t block) = 0;
  virtual void PutSurface(SurfacePart part, ReconstructionId reconstruction, GridPlace tile,
                          std::span<const uint8_t> bytes) = 0;
  virtual void DeleteTile(ReconstructionId reconstruction,
                          GridPlace tile) = 0;                             // with all its parts
  virtual void DeleteReconstruction(ReconstructionId reconstruction) = 0;  // settings and tiles
};

}  // namespace veduta
