// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/map_loader.h"

#include <set>

namespace veduta {

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

Status MapLoader::LoadImages(std::span<const ImageId> images) {
  for (const ImageId id : images) {
    if (map_->HasImage(id)) continue;
    VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, snapshot_->FindPose(id));
    if (!pose) continue;
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
    map_->LoadImage(std::move(image));
  }
  return Status::Ok();
}

Status MapLoader::LoadBlocks(std::span<const ImageId> homes) {
  for (const ImageId home : homes) {
    if (map_->HasBlock(home)) continue;
    VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, snapshot_->FindPose(home));
    if (!pose)
      return Status::Corruption("image " + std::to_string(home.value) +
                                " is home to points and has no pose");
    VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record,
                            GetReconstruction(pose->reconstruction));
    VEDUTA_ASSIGN_OR_RETURN(const PointBlock block,
                            snapshot_->GetPointBlock(record.id, record.points_generation, home));
    map_->LoadBlock(block);
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

Status MapLoader::LoadNeighborhood(std::span<const ImageId> images) {
  VEDUTA_RETURN_IF_ERROR(LoadStructure(images));
  std::set<ImageId> seen;
  for (const ImageId id : images) {
    if (!map_->HasImage(id)) continue;
    for (const PointId point : map_->image(id).points) {
      const PointRecord* record = point.valid() ? map_->FindPoint(point) : nullptr;
      if (record == nullptr) continue;
      seen.insert(point.home);
      for (const TrackElement& element : record->track) seen.insert(element.image);
    }
  }
  return LoadImages(std::vector(seen.begin(), seen.end()));
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
