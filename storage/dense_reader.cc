// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "storage/dense_view.h"
#include "storage/record_finder.h"
#include "storage/records/dense_settings.h"
#include "storage/records/depth_record.h"
#include "storage/records/tile_record.h"
#include "storage/stored_bytes.h"

namespace veduta {
namespace {

std::string Place(GridPlace place) {
  return std::to_string(place.x) + "," + std::to_string(place.y) + "," + std::to_string(place.z);
}

std::string_view Prefix(const std::string& key) {
  return std::string_view(key).substr(0, 1);
}

class View final : public DenseReader {
 public:
  explicit View(const ValueReader& reader) : reader_(reader) {}

  Result<std::optional<DenseSettings>> FindSettings(
      ReconstructionId reconstruction) const override {
    DenseSettings settings{.reconstruction = reconstruction};
    return FindRecord(reader_, Family::kDense, DenseSettingsKey(reconstruction),
                      std::move(settings));
  }

  Result<std::vector<DenseSettings>> ListSettings() const override {
    std::vector<DenseSettings> all;
    const std::string prefix = DenseSettingsKey(ReconstructionId(1)).substr(0, 1);
    VEDUTA_RETURN_IF_ERROR(
        reader_.Scan(Family::kDense, prefix, "",
                     [&](std::string_view key, std::string_view value, bool* /*more*/) {
                       DenseSettings settings;
                       VEDUTA_RETURN_IF_ERROR(ParseDenseKey(key, &settings.reconstruction));
                       VEDUTA_RETURN_IF_ERROR(Decode(value, &settings));
                       all.push_back(settings);
                       return Status::Ok();
                     }));
    return all;
  }

  Result<std::optional<DepthRecord>> FindDepth(ImageId image) const override {
    DepthRecord depth;
    depth.image = image;
    return FindRecord(reader_, Family::kDense, DepthKey(image), std::move(depth));
  }

  Status ScanDepths(const std::function<bool(const DepthRecord&)>& visit) const override {
    const std::string first = DepthKey(ImageId(1));
    return reader_.Scan(Family::kDense, Prefix(first), "",
                        [&](std::string_view key, std::string_view value, bool* more) {
                          DepthRecord depth;
                          VEDUTA_RETURN_IF_ERROR(ParseDenseKey(key, &depth.image));
                          VEDUTA_RETURN_IF_ERROR(Decode(value, &depth));
                          *more = visit(depth);
                          return Status::Ok();
                        });
  }

  Result<DepthPixels> GetDepthPixels(ImageId image) const override {
    return GetPixels(DepthKey(image), "depth map of image " + std::to_string(image.value));
  }

  Result<CheckedDepthRecord> GetCheckedDepth(ImageId image, uint64_t version) const override {
    CheckedDepthRecord depth;
    depth.image = image;
    depth.version = version;
    VEDUTA_ASSIGN_OR_RETURN(
        auto found,
        FindRecord(reader_, Family::kDense, CheckedDepthKey(image, version), std::move(depth)));
    if (!found)
      return Status::NotFound("there is no such checked depth map of image " +
                              std::to_string(image.value));
    return std::move(*found);
  }

  Status ScanCheckedDepths(
      const std::function<bool(const CheckedDepthRecord&)>& visit) const override {
    const std::string first = CheckedDepthKey(ImageId(1), 0);
    return reader_.Scan(Family::kDense, Prefix(first), "",
                        [&](std::string_view key, std::string_view value, bool* more) {
                          CheckedDepthRecord depth;
                          VEDUTA_RETURN_IF_ERROR(ParseDenseKey(key, &depth.image, &depth.version));
                          VEDUTA_RETURN_IF_ERROR(Decode(value, &depth));
                          *more = visit(depth);
                          return Status::Ok();
                        });
  }

  Result<DepthPixels> GetCheckedDepthPixels(ImageId image, uint64_t version) const override {
    return GetPixels(CheckedDepthKey(image, version),
                     "checked depth map of image " + std::to_string(image.value));
  }

  Result<std::optional<TileRecord>> FindTile(ReconstructionId reconstruction,
                                             GridPlace place) const override {
    TileRecord tile;
    tile.reconstruction = reconstruction;
    tile.place = place;
    return FindRecord(reader_, Family::kDense, TileKey(reconstruction, place), std::move(tile));
  }

  Status ScanTiles(ReconstructionId reconstruction,
                   const std::function<bool(const TileRecord&)>& visit) const override {
    return reader_.Scan(
        Family::kDense, TilePrefix(reconstruction), "",
        [&](std::string_view key, std::string_view value, bool* more) {
          TileRecord tile;
          VEDUTA_RETURN_IF_ERROR(ParseDenseKey(key, &tile.reconstruction, &tile.place));
          VEDUTA_RETURN_IF_ERROR(Decode(value, &tile));
          *more = visit(tile);
          return Status::Ok();
        });
  }

  Result<StoredBytes> GetVolumeBlock(ReconstructionId reconstruction, GridPlace tile,
                                     uint8_t block) const override {
    return GetBytes(Family::kVolume, VolumeKey(reconstruction, tile, block),
                    "block " + std::to_string(block) + " of tile " + Place(tile));
  }

  Result<StoredBytes> GetSurface(SurfacePart part, ReconstructionId reconstruction,
                                 GridPlace tile) const override {
    return GetBytes(Family::kSurface, SurfaceKey(part, reconstruction, tile),
                    "surface of tile " + Place(tile) + " of reconstruction " +
                        std::to_string(reconstruction.value));
  }

  Status ScanAll(const std::function<void(uint8_t, std::span<const uint8_t>,
                                          std::span<const uint8_t>)>& visit) const override {
    const auto bytes = [](std::string_view text) {
      return std::span(reinterpret_cast<const uint8_t*>(text.data()), text.size());
    };
    for (const FamilyTraits& traits : AllFamilies()) {
      if (!traits.digested_whole) continue;
      VEDUTA_RETURN_IF_ERROR(reader_.Scan(
          traits.family, "", "", [&](std::string_view key, std::string_view value, bool* /*more*/) {
            visit(static_cast<uint8_t>(traits.family), bytes(key), bytes(value));
            return Status::Ok();
          }));
    }
    return Status::Ok();
  }

 private:
  Result<DepthPixels> GetPixels(const std::string& key, const std::string& what) const {
    VEDUTA_ASSIGN_OR_RETURN(auto found, FindRecord(reader_, Family::kDepth, key, DepthPixels()));
    if (!found) return Status::NotFound("there is no " + what);
    return std::move(*found);
  }

  Result<StoredBytes> GetBytes(Family family, const std::string& key,
                               const std::string& what) const {
    std::string value;
    VEDUTA_ASSIGN_OR_RETURN(const bool found, reader_.Copy(family, key, &value));
    if (!found) return Status::NotFound("there is no " + what);
    return StoredBytes(std::move(value));
  }

  const ValueReader& reader_;
};

}  // namespace

std::unique_ptr<const DenseReader> MakeDenseReader(const ValueReader& reader) {
  return std::make_unique<View>(reader);
}

}  // namespace veduta
