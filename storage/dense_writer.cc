// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "storage/dense_view.h"
#include "storage/records/dense_settings.h"
#include "storage/records/depth_record.h"
#include "storage/records/tile_record.h"

namespace veduta {
namespace {

std::string_view Text(std::span<const uint8_t> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

constexpr SurfacePart kParts[] = {SurfacePart::kSolution, SurfacePart::kMesh, SurfacePart::kColors,
                                  SurfacePart::kFirstRound};

class Writer final : public DenseWriter {
 public:
  explicit Writer(std::function<WriteBuffer&()> buffer) : buffer_(std::move(buffer)) {}

  void PutSettings(const DenseSettings& settings) override {
    buffer_().Put(Family::kDense, DenseSettingsKey(settings.reconstruction), Encode(settings));
  }

  void PutDepth(const DepthRecord& depth) override {
    buffer_().Put(Family::kDense, DepthKey(depth.image), Encode(depth));
  }

  void PutDepthPixels(ImageId image, const DepthPixels& pixels) override {
    buffer_().Put(Family::kDepth, DepthKey(image), Encode(pixels));
  }

  void DeleteDepth(ImageId image) override {
    buffer_().Delete(Family::kDense, DepthKey(image));
    buffer_().Delete(Family::kDepth, DepthKey(image));
  }

  void PutCheckedDepth(const CheckedDepthRecord& depth, const DepthPixels& pixels) override {
    const std::string key = CheckedDepthKey(depth.image, depth.version);
    buffer_().Put(Family::kDense, key, Encode(depth));
    buffer_().Put(Family::kDepth, key, Encode(pixels));
  }

  void DeleteCheckedDepth(ImageId image, uint64_t version) override {
    const std::string key = CheckedDepthKey(image, version);
    buffer_().Delete(Family::kDense, key);
    buffer_().Delete(Family::kDepth, key);
  }

  void PutTile(const TileRecord& tile) override {
    buffer_().Put(Family::kDense, TileKey(tile.reconstruction, tile.place), Encode(tile));
  }

  void PutVolumeBlock(ReconstructionId reconstruction, GridPlace tile, uint8_t block,
                      std::span<const uint8_t> bytes) override {
    buffer_().Put(Family::kVolume, VolumeKey(reconstruction, tile, block), Text(bytes));
  }

  void DeleteVolumeBlock(ReconstructionId reconstruction, GridPlace tile, uint8_t block) override {
    buffer_().Delete(Family::kVolume, VolumeKey(reconstruction, tile, block));
  }

  void PutSurface(SurfacePart part, ReconstructionId reconstruction, GridPlace tile,
                  std::span<const uint8_t> bytes) override {
    buffer_().Put(Family::kSurface, SurfaceKey(part, reconstruction, tile), Text(bytes));
  }

  void DeleteTile(ReconstructionId reconstruction, GridPlace tile) override {
    buffer_().Delete(Family::kDense, TileKey(reconstruction, tile));
    buffer_().DeletePrefix(Family::kVolume, VolumePrefix(reconstruction, tile));
    for (const SurfacePart part : kParts)
      buffer_().Delete(Family::kSurface, SurfaceKey(part, reconstruction, tile));
  }

  void DeleteReconstruction(ReconstructionId reconstruction) override {
    buffer_().Delete(Family::kDense, DenseSettingsKey(reconstruction));
    buffer_().DeletePrefix(Family::kDense, TilePrefix(reconstruction));
    buffer_().DeletePrefix(Family::kVolume, VolumePrefix(reconstruction));
    for (const SurfacePart part : kParts)
      buffer_().DeletePrefix(Family::kSurface, SurfacePrefix(part, reconstruction));
  }

 private:
  const std::function<WriteBuffer&()> buffer_;
};

}  // namespace

std::unique_ptr<DenseWriter> MakeDenseWriter(std::function<WriteBuffer&()> buffer) {
  return std::make_unique<Writer>(std::move(buffer));
}

}  // namespace veduta
