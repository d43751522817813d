// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/map_loader.h"

#include <algorithm>
#include <iterator>
#include <set>
#include <string>

namespace veduta {
namespace {

// Points that were ever made from one photo: their places are memory. A photo has 8192 features by
// default, so each may have been triangulated 500 times. Chosen by hand; not measured.
constexpr uint32_t kOrdinalsMax = 1 << 22;

std::string Name(ImageId id) {
  return "image " + std::to_string(id.value);
}
std::string Name(PointId id) {
  return "point " + std::to_string(id.home.value) + "/" + std::to_string(id.ordinal);
}

Status Contradiction(const std::string& what) {
  return Status::Corruption("families points and observations: " + what +
                            "; `veduta verify` lists all that is damaged");
}

}  // namespace

MapImage UnplacedImage(const ImageFeatures& features) {
  MapImage image;
  image.id = features.id;
  image.camera = features.camera;
  image.width_px = features.width_px;
  image.height_px = features.height_px;
  image.features = features.features;
  image.grid = features.grid;
  image.points.resize(features.features->size());
  return image;
}

Result<ReconstructionRecord> MapLoader::GetReconstruction(ReconstructionId id) {
  if (const auto it = reconstructions_.find(id); it != reconstructions_.end()) return it->second;
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record, snapshot_->GetReconstruction(id));
  return reconstructions_[id] = record;
}

Result<std::optional<MapImage>> MapLoader::ReadImage(ImageId id) const {
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, snapshot_->FindPose(id));
  if (!pose) return std::optional<MapImage>();
  VEDUTA_ASSIGN_OR_RETURN(const std::shared_ptr<const ImageFeatures> features,
                          features_->Get(*snapshot_, id));
  MapImage image = UnplacedImage(*features);
  image.reconstruction = pose->reconstruction;
  image.cam_from_world = pose->cam_from_world;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<Observation> observations,
                          snapshot_->GetObservations(id));
  for (const Observation& observation : observations) {
    if (observation.feature >= image.points.size()) {
      return Status::Corruption(
          "image " + std::to_string(id.value) + " observes a point by feature " +
          std::to_string(observation.feature) + " of " + std::to_string(image.points.size()));
    }
    image.points[observation.feature] = observation.point;
  }
  return std::optional(std::move(image));
}

bool MapLoader::IsToLoad(ImageId id) const {
  return !map_->HasImage(id) && !map_->changes().unplaced.contains(id);
}

void MapLoader::ForEach(size_t count, const std::function<void(size_t)>& body) const {
  if (pool_ != nullptr) return pool_->ParallelFor(count, body);
  for (size_t i = 0; i < count; ++i) body(i);
}

// Of several errors, that of the first image.
Status MapLoader::LoadImages(std::span<const ImageId> images) {
  std::vector<ImageId> wanted;
  std::ranges::copy_if(images, std::back_inserter(wanted),
                       [&](ImageId id) { return IsToLoad(id); });
  std::vector<Result<std::optional<MapImage>>> read(wanted.size(), std::optional<MapImage>());
  ForEach(wanted.size(), [&](size_t i) { read[i] = ReadImage(wanted[i]); });
  for (Result<std::optional<MapImage>>& image : read) {
    VEDUTA_RETURN_IF_ERROR(image.status());
    if (!*image || map_->HasImage((*image)->id)) continue;
    map_->LoadImage(std::move(**image));
    has_loaded_ = true;
  }
  return Status::Ok();
}

Result<uint32_t> MapLoader::CountFeatures(ImageId id) const {
  if (map_->HasImage(id)) return static_cast<uint32_t>(map_->image(id).features->size());
  VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, snapshot_->GetImage(id));
  return image.feature_count;
}

Result<PairRecord> MapLoader::GetPair(ImageId a, ImageId b) const {
  VEDUTA_ASSIGN_OR_RETURN(PairRecord pair, snapshot_->GetPair(a, b));
  VEDUTA_ASSIGN_OR_RETURN(const uint32_t count_a, CountFeatures(pair.a));
  VEDUTA_ASSIGN_OR_RETURN(const uint32_t count_b, CountFeatures(pair.b));
  for (const FeatureMatch& match : pair.matches) {
    if (match.a < count_a && match.b < count_b) continue;
    return Status::Corruption("family pairs: the pair of " + Name(pair.a) + " and " + Name(pair.b) +
                              " matches a feature that does not exist");
  }
  return pair;
}

Status MapLoader::CheckSeenBy(const MapImage& image) const {
  for (FeatureIndex f = 0; f < image.points.size(); ++f) {
    const PointId point = image.points[f];
    if (!point.valid()) continue;
    const PointRecord* const record = map_->FindPoint(point);
    const auto is_own = [&](const TrackElement& e) {
      return e.image == image.id && e.feature == f;
    };
    if (record == nullptr || std::ranges::none_of(record->track, is_own))
      return Contradiction(Name(image.id) + " observes " + Name(point) +
                           ", whose track says no such thing");
    for (const TrackElement& element : record->track) {
      const MapImage* const other =
          map_->HasImage(element.image) ? &map_->image(element.image) : nullptr;
      if (other == nullptr || element.feature >= other->points.size() ||
          other->points[element.feature] != point ||
          other->reconstruction != image.reconstruction) {
        return Contradiction(Name(point) + " is seen in " + Name(element.image) +
                             ", which says no such thing");
      }
    }
  }
  return Status::Ok();
}

Status MapLoader::CheckSeen(std::span<const ImageId> images) {
  std::vector<const MapImage*> unchecked;
  for (const ImageId id : images) {
    if (map_->HasImage(id) && !checked_.contains(id)) unchecked.push_back(&map_->image(id));
  }
  std::vector<Status> found(unchecked.size());
  ForEach(unchecked.size(), [&](size_t i) { found[i] = CheckSeenBy(*unchecked[i]); });
  for (size_t i = 0; i < unchecked.size(); ++i) {
    VEDUTA_RETURN_IF_ERROR(found[i]);
    checked_.insert(unchecked[i]->id);
  }
  return Status::Ok();
}

Result<ReconstructionRecord> MapLoader::HomeOf(ImageId image) {
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, snapshot_->FindPose(image));
  if (!pose) {
    return Status::Corruption("image " + std::to_string(image.value) +
                              " is home to points and has no pose");
  }
  return GetReconstruction(pose->reconstruction);
}

Status MapLoader::LoadBlocks(std::span<const ImageId> homes) {
  struct Wanted {
    ImageId home;
    ReconstructionId reconstruction;
    uint32_t points_generation;
  };
  std::vector<Wanted> wanted;
  for (const ImageId home : homes) {
    if (map_->HasBlock(home)) continue;
    VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record, HomeOf(home));
    wanted.push_back({home, record.id, record.points_generation});
  }
  std::vector<Result<PointBlock>> read(wanted.size(), PointBlock());
  ForEach(wanted.size(), [&](size_t i) {
    const auto& [home, reconstruction, generation] = wanted[i];
    read[i] = snapshot_->GetPointBlock(reconstruction, generation, home);
  });
  for (const Result<PointBlock>& block : read) {
    VEDUTA_RETURN_IF_ERROR(block.status());
    if (block->next_ordinal > kOrdinalsMax) {
      return Status::Corruption("family points: " + Name(block->home) +
                                " gives its next point number " +
                                std::to_string(block->next_ordinal));
    }
    map_->LoadBlock(*block);
    has_loaded_ = true;
  }
  return Status::Ok();
}

Status MapLoader::LoadStructure(std::span<const ImageId> images) {
  VEDUTA_RETURN_IF_ERROR(LoadImages(images));
  std::set<ImageId> homes;
  for (const ImageId id : images) {
    if (!map_->HasImage(id)) continue;
    homes.insert(id);
    for (const PointId point : map_->image(id).points) {
      if (point.valid()) homes.insert(point.home);
    }
  }
  return LoadBlocks(std::vector(homes.begin(), homes.end()));
}

std::vector<ImageId> MapLoader::WithoutNeighborhood(std::span<const ImageId> images) {
  if (edit_count_ != map_->edit_count()) neighborhoods_.clear();
  edit_count_ = map_->edit_count();
  std::vector<ImageId> without;
  for (const ImageId id : images) {
    if (!neighborhoods_.contains(id)) without.push_back(id);
  }
  return without;
}

std::vector<ImageId> MapLoader::ListAround(std::span<const ImageId> images) const {
  std::vector<std::vector<ImageId>> around(images.size());
  ForEach(images.size(), [&](size_t i) {
    if (!map_->HasImage(images[i])) return;
    std::unordered_set<ImageId> seen;
    ImageId last;  // tracks that follow one another begin alike
    const auto see = [&](ImageId id) {
      if (id != last) seen.insert(id);
      last = id;
    };
    for (const PointId point : map_->image(images[i]).points) {
      const PointRecord* const record = point.valid() ? map_->FindPoint(point) : nullptr;
      if (record == nullptr) continue;
      see(point.home);
      for (const TrackElement& element : record->track) see(element.image);
    }
    around[i].assign(seen.begin(), seen.end());
  });
  std::vector<ImageId> all;
  for (const std::vector<ImageId>& of_one : around)
    all.insert(all.end(), of_one.begin(), of_one.end());
  std::ranges::sort(all);
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

Status MapLoader::LoadNeighborhood(std::span<const ImageId> images) {
  const std::vector<ImageId> wanted = WithoutNeighborhood(images);
  VEDUTA_RETURN_IF_ERROR(LoadStructure(wanted));
  VEDUTA_RETURN_IF_ERROR(LoadImages(ListAround(wanted)));
  if (has_loaded_) {
    has_loaded_ = false;
    VEDUTA_RETURN_IF_ERROR(CheckSeen(images));
  }
  neighborhoods_.insert(wanted.begin(), wanted.end());
  return Status::Ok();
}

Status MapLoader::LoadToUnplace(ImageId image) {
  VEDUTA_RETURN_IF_ERROR(LoadNeighborhood({&image, 1}));
  std::set<ImageId> seen;
  for (const PointRecord& point : map_->StoredBlock(image).points) {
    for (const TrackElement& element : point.track) seen.insert(element.image);
  }
  return LoadStructure(std::vector(seen.begin(), seen.end()));
}

Status MapLoader::LoadReconstruction(ReconstructionId id, std::vector<ImageId>* images) {
  images->clear();
  VEDUTA_RETURN_IF_ERROR(snapshot_->ScanPoses([&](const PoseRecord& pose) {
    if (pose.reconstruction == id) images->push_back(pose.image);
    return true;
  }));
  return LoadNeighborhood(*images);
}

}  // namespace veduta
