// SPDX-License-Identifier: Apache-2.0
#include "engine/localization/near_images.h"

#include <algorithm>
#include <functional>
#include <map>
#include <utility>

#include "engine/earth/local_frame.h"
#include "engine/query/find_image.h"
#include "engine/query/living.h"

namespace veduta {
namespace {

// Chosen by hand: half of what retrieval ranks.
constexpr size_t kNearMax = 12;

// A reconstruction in the frame of its place on the earth, and where in it the photo was taken.
struct PlacedFrame {
  Sim3 enu_from_world;
  Eigen::Vector3d taken_enu_m;
};

}  // namespace

Result<std::vector<ImageId>> ImagesNear(const Snapshot& snapshot, const std::string& photo,
                                        const Sight& sight) {
  VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, FindImage(snapshot, photo, sight));
  VEDUTA_ASSIGN_OR_RETURN(std::vector<PairNeighbor> neighbors, snapshot.ListNeighbors(image.id));
  std::ranges::stable_sort(neighbors, std::greater<>(), &PairNeighbor::match_count);
  std::vector<ImageId> near = {image.id};
  for (const PairNeighbor& neighbor : neighbors) {
    if (near.size() == kNearMax) break;
    near.push_back(neighbor.image);
  }
  return near;
}

Result<std::vector<ImageId>> ImagesNear(const Snapshot& snapshot, const GeoPosition& place) {
  std::map<ReconstructionId, PlacedFrame> frames;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ReconstructionRecord> living, ListLiving(snapshot));
  for (const ReconstructionRecord& record : living) {
    const auto& known = record.georeference.place;
    if (!known) continue;
    frames[record.id] = {known->enu_from_world, LocalFrame(known->origin).FromGeo(place)};
  }
  std::vector<std::pair<double, ImageId>> ranked;
  if (frames.empty()) return std::vector<ImageId>();
  VEDUTA_RETURN_IF_ERROR(snapshot.ScanPoses([&](const PoseRecord& pose) {
    const auto frame = frames.find(pose.reconstruction);
    if (frame == frames.end()) return true;
    const auto& [enu_from_world, taken_enu_m] = frame->second;
    const Eigen::Vector3d apart_m = enu_from_world * pose.cam_from_world.Center() - taken_enu_m;
    ranked.emplace_back(apart_m.head<2>().squaredNorm(), pose.image);
    return true;
  }));
  const size_t count = std::min(ranked.size(), kNearMax);
  std::partial_sort(ranked.begin(), ranked.begin() + static_cast<ptrdiff_t>(count), ranked.end());
  std::vector<ImageId> near;
  for (size_t i = 0; i < count; ++i) near.push_back(ranked[i].second);
  return near;
}

}  // namespace veduta
