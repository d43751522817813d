// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/city_map.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <deque>

#include "storage/base/status.h"
#include "storage/base/transform.h"

namespace veduta {
namespace {

std::string Name(PointId id) {
  return "point " + std::to_string(id.home.value) + "/" + std::to_string(id.ordinal);
}

auto FindElement(auto& track, ImageId image) {
  return std::lower_bound(track.begin(), track.end(), image,
                          [](const TrackElement& e, ImageId id) { return e.image < id; });
}

// The mean over the features that see it.
std::array<uint8_t, 3> ColorOf(const CityMap& map, std::span<const TrackElement> track) {
  std::array<uint32_t, 3> sum{};
  for (const TrackElement& element : track) {
    const Keypoint& seen = map.image(element.image).features->keypoints[element.feature];
    for (int c = 0; c < 3; ++c) sum[c] += seen.rgb[c];
  }
  std::array<uint8_t, 3> rgb{};
  for (int c = 0; c < 3; ++c) rgb[c] = static_cast<uint8_t>(sum[c] / track.size());
  return rgb;
}

}  // namespace

const MapImage& CityMap::image(ImageId id) const {
  const MapImage* const found = image_table_.Find(id);
  VEDUTA_CHECK(found != nullptr, "image " + std::to_string(id.value) + " is not loaded");
  return *found;
}

CityMap::Block& CityMap::MakeBlock(ImageId home) {
  Block& block = blocks_[home];
  block_table_.Set(home, &block);
  return block;
}

MapImage& CityMap::MutableImage(ImageId id) {
  return const_cast<MapImage&>(image(id));
}

const PointRecord* CityMap::FindPoint(PointId id) const {
  const Block* const block = block_table_.Find(id.home);
  if (block == nullptr || id.ordinal == 0 || id.ordinal > block->points.size()) return nullptr;
  const PointRecord& point = block->points[id.ordinal - 1];
  return point.track.empty() ? nullptr : &point;
}

const PointRecord& CityMap::point(PointId id) const {
  const PointRecord* found = FindPoint(id);
  VEDUTA_CHECK(found != nullptr, Name(id) + " is not loaded or gone");
  return *found;
}

PointRecord& CityMap::MutablePoint(PointId id) {
  changes_.blocks.insert(id.home);
  return const_cast<PointRecord&>(point(id));
}

PointBlock CityMap::StoredBlock(ImageId home) const {
  const Block* const held = block_table_.Find(home);
  VEDUTA_CHECK(held != nullptr,
               "points of image " + std::to_string(home.value) + " are not loaded");
  PointBlock block;
  block.home = home;
  block.next_ordinal = static_cast<uint32_t>(held->points.size()) + 1;
  for (const PointRecord& point : held->points) {
    if (!point.track.empty()) block.points.push_back(point);
  }
  return block;
}

std::vector<PointId> CityMap::PointsSeenBy(std::span<const ImageId> images) const {
  // A bit for each point of each home: that sorts and takes each once.
  struct Home {
    ImageId id;
    const Block* block;
    std::vector<uint64_t> seen;
  };
  std::deque<Home> homes;  // the table points into it
  ImageTable<Home> home_of;
  for (const ImageId id : images) {
    for (const PointId point : image(id).points) {
      if (!point.valid()) continue;
      Home* home = home_of.Find(point.home);
      if (home == nullptr) {
        const Block* const block = block_table_.Find(point.home);
        if (block == nullptr) continue;
        const size_t words = (block->points.size() + 63) / 64;
        home = &homes.emplace_back(Home{point.home, block, std::vector<uint64_t>(words)});
        home_of.Set(point.home, home);
      }
      const uint32_t bit = point.ordinal - 1;
      if (bit < home->block->points.size()) home->seen[bit / 64] |= uint64_t{1} << bit % 64;
    }
  }
  std::sort(homes.begin(), homes.end(), [](const Home& a, const Home& b) { return a.id < b.id; });
  std::vector<PointId> points;
  for (const Home& home : homes) {
    for (uint32_t word = 0; word < home.seen.size(); ++word) {
      for (uint64_t left = home.seen[word]; left != 0; left &= left - 1) {
        const uint32_t bit = 64 * word + static_cast<uint32_t>(std::countr_zero(left));
        if (!home.block->points[bit].track.empty()) points.push_back({home.id, bit + 1});
      }
    }
  }
  return points;
}

std::vector<Sighting> CityMap::ViewsOf(const PointRecord& point) const {
  std::vector<Sighting> views;
  views.reserve(point.track.size());
  for (const TrackElement& element : point.track) {
    const MapImage* const image = image_table_.Find(element.image);
    if (image != nullptr) views.push_back(image->ViewOf(element.feature));
  }
  return views;
}

void CityMap::LoadImage(MapImage image) {
  VEDUTA_CHECK(image.features != nullptr && image.points.size() == image.features->size(),
               "features and points differ");
  const ImageId id = image.id;
  image_table_.Set(id, &images_.insert_or_assign(id, std::move(image)).first->second);
}

void CityMap::LoadBlock(const PointBlock& block) {
  std::vector<PointRecord> points(block.next_ordinal - 1);
  for (const PointRecord& point : block.points) points[point.id.ordinal - 1] = point;
  MakeBlock(block.home).points = std::move(points);
}

void CityMap::PlaceImage(MapImage image) {
  VEDUTA_CHECK(!HasImage(image.id),
               "image " + std::to_string(image.id.value) + " has a pose already");
  const ImageId id = image.id;
  LoadImage(std::move(image));
  MakeBlock(id);
  changes_.poses.insert(id);
  changes_.observations.insert(id);
}

void CityMap::SetLens(ImageId id, const Pinhole& camera, std::shared_ptr<const Features> features,
                      std::shared_ptr<const FeatureGrid> grid) {
  MapImage& image = MutableImage(id);
  VEDUTA_CHECK(features->size() == image.points.size(), "a lens changes no number of features");
  image.camera = camera;
  image.features = std::move(features);
  image.grid = std::move(grid);
}

void CityMap::SetPose(ImageId id, const Rigid3& cam_from_world) {
  MutableImage(id).cam_from_world = cam_from_world;
  changes_.poses.insert(id);
}

PointId CityMap::MoveHome(PointId id, ImageId home) {
  const PointRecord moved = point(id);
  RemovePoint(id);
  return AddPoint(home, moved.position, moved.track);
}

void CityMap::UnplaceImage(ImageId id) {
  ++edit_count_;
  const ReconstructionId reconstruction = image(id).reconstruction;
  for (const PointId point : std::vector<PointId>(image(id).points)) {
    if (point.valid()) RemoveObservation(point, id);
  }
  for (const PointRecord& point : StoredBlock(id).points)
    MoveHome(point.id, point.track.front().image);
  image_table_.Erase(id);
  block_table_.Erase(id);
  images_.erase(id);
  blocks_.erase(id);
  changes_.poses.erase(id);
  changes_.observations.erase(id);
  changes_.blocks.erase(id);
  changes_.unplaced[id] = reconstruction;
}

void CityMap::ExchangePicture(MapImage with, std::span<const FeatureMatch> counterparts) {
  ++edit_count_;
  const ImageId id = with.id;
  std::vector<std::pair<PointId, FeatureIndex>> kept;
  std::vector<PointId> lost = image(id).points;
  for (const FeatureMatch& match : counterparts) {
    if (!lost[match.a].valid()) continue;
    kept.emplace_back(lost[match.a], match.b);
    lost[match.a] = {};
  }
  for (const PointId point : lost) {
    if (point.valid()) RemoveObservation(point, id);
  }
  for (const auto& [point_id, feature] : kept) CountPoint(point(point_id), -1);
  MapImage& held = MutableImage(id);
  with.reconstruction = held.reconstruction;
  with.cam_from_world = held.cam_from_world;
  with.points.assign(with.features->size(), {});
  held = std::move(with);
  changes_.observations.insert(id);
  for (const auto& [point_id, feature] : kept) {
    PointRecord& point = MutablePoint(point_id);
    FindElement(point.track, id)->feature = feature;
    held.points[feature] = point_id;
    Measure(&point);
    CountPoint(point, 1);
  }
}

void CityMap::CutOff(const std::set<ImageId>& part) {
  std::vector<ImageId> all;
  for (const auto& [id, image] : images_) all.push_back(id);
  for (const PointId id : PointsSeenBy(all)) {
    const std::vector<TrackElement> track = point(id).track;
    const auto is_in = [&](const TrackElement& e) { return part.contains(e.image); };
    const size_t inside = std::count_if(track.begin(), track.end(), is_in);
    const bool stays_inside = 2 * inside >= track.size();
    for (const TrackElement& element : track) {
      if (is_in(element) != stays_inside && FindPoint(id) != nullptr)
        RemoveObservation(id, element.image);
    }
    const PointRecord* const kept = FindPoint(id);
    if (kept != nullptr && part.contains(id.home) != stays_inside)
      MoveHome(id, kept->track.front().image);
  }
}

void CityMap::CountPoint(const PointRecord& point, int sign) {
  ++edit_count_;
  CountChange& change = changes_.counts[image(point.track.front().image).reconstruction];
  change.points += sign;
  change.observations += sign * static_cast<int64_t>(point.track.size());
  change.reprojection_error_px_sum +=
      sign * static_cast<double>(point.error_px) * static_cast<double>(point.track.size());
}

void CityMap::Measure(PointRecord* point) const {
  double sum = 0;
  const std::vector<Sighting> views = ViewsOf(*point);
  for (const Sighting& view : views)
    sum += std::min(ReprojectionErrorPx(view, point->position), 1e6);
  point->error_px =
      views.empty() ? 0.0f : static_cast<float>(sum / static_cast<double>(views.size()));
}

PointId CityMap::AddPoint(ImageId home, const Eigen::Vector3d& position,
                          std::vector<TrackElement> track) {
  VEDUTA_CHECK(track.size() >= 2, "a track of " + std::to_string(track.size()));
  Block* const block = block_table_.Find(home);
  VEDUTA_CHECK(block != nullptr,
               "points of image " + std::to_string(home.value) + " are not loaded");
  std::sort(track.begin(), track.end(),
            [](const TrackElement& a, const TrackElement& b) { return a.image < b.image; });
  PointRecord point;
  point.id = {home, static_cast<uint32_t>(block->points.size()) + 1};
  point.position = position;
  for (const TrackElement& element : track) {
    MapImage& seen_in = MutableImage(element.image);
    VEDUTA_CHECK(!seen_in.points[element.feature].valid(),
                 "a feature of " + Name(point.id) + " has a point already");
    seen_in.points[element.feature] = point.id;
    changes_.observations.insert(element.image);
  }
  point.rgb = ColorOf(*this, track);
  point.track = std::move(track);
  Measure(&point);
  CountPoint(point, 1);
  block->points.push_back(std::move(point));
  changes_.blocks.insert(home);
  return block->points.back().id;
}

void CityMap::AddObservation(PointId id, TrackElement element) {
  MapImage& seen_in = MutableImage(element.image);
  VEDUTA_CHECK(!seen_in.points[element.feature].valid(),
               "the feature has a point already, not " + Name(id));
  PointRecord& point = MutablePoint(id);
  CountPoint(point, -1);
  const auto at = FindElement(point.track, element.image);
  VEDUTA_CHECK(at == point.track.end() || at->image != element.image,
               Name(id) + " is seen in the image already");
  point.track.insert(at, element);
  seen_in.points[element.feature] = id;
  changes_.observations.insert(element.image);
  Measure(&point);
  CountPoint(point, 1);
}

void CityMap::RemoveObservation(PointId id, ImageId image) {
  if (point(id).track.size() <= 2) return RemovePoint(id);
  PointRecord& point = MutablePoint(id);
  CountPoint(point, -1);
  const auto at = FindElement(point.track, image);
  VEDUTA_CHECK(at != point.track.end() && at->image == image,
               Name(id) + " is not seen in the image");
  MutableImage(image).points[at->feature] = {};
  changes_.observations.insert(image);
  point.track.erase(at);
  point.rgb = ColorOf(*this, point.track);  // nothing of a photo that is taken out stays
  Measure(&point);
  CountPoint(point, 1);
}

void CityMap::RemovePoint(PointId id) {
  PointRecord& point = MutablePoint(id);
  CountPoint(point, -1);
  for (const TrackElement& element : point.track) {
    MutableImage(element.image).points[element.feature] = {};
    changes_.observations.insert(element.image);
  }
  point = {};
}

bool CityMap::SharesImage(const PointRecord& a, const PointRecord& b) const {
  auto i = a.track.begin(), j = b.track.begin();
  while (i != a.track.end() && j != b.track.end()) {
    if (i->image == j->image) return true;
    i->image < j->image ? ++i : ++j;
  }
  return false;
}

void CityMap::MergePoints(PointId keep_id, PointId drop_id) {
  const std::vector<TrackElement> moved = point(drop_id).track;
  RemovePoint(drop_id);
  PointRecord& keep = MutablePoint(keep_id);
  CountPoint(keep, -1);
  for (const TrackElement& element : moved) {
    const auto at = FindElement(keep.track, element.image);
    VEDUTA_CHECK(at == keep.track.end() || at->image != element.image,
                 "merged points share an image");
    keep.track.insert(at, element);
    MutableImage(element.image).points[element.feature] = keep_id;
  }
  Measure(&keep);
  CountPoint(keep, 1);
}

void CityMap::SetPosition(PointId id, const Eigen::Vector3d& position) {
  PointRecord& point = MutablePoint(id);
  CountPoint(point, -1);
  point.position = position;
  Measure(&point);
  CountPoint(point, 1);
}

void CityMap::MoveImage(ImageId id, ReconstructionId into, const Sim3& into_from_old) {
  MapImage& image = MutableImage(id);
  image.reconstruction = into;
  image.cam_from_world = TransformCameraWorld(into_from_old, image.cam_from_world);
  changes_.poses.insert(id);
}

void CityMap::MoveBlock(ImageId home, ReconstructionId into, const Sim3& into_from_old) {
  for (PointRecord& point : blocks_.at(home).points) {
    if (!point.track.empty()) point.position = into_from_old * point.position;
  }
  changes_.blocks.insert(home);
}

void CityMap::Clear() {
  image_table_.Clear();
  block_table_.Clear();
  images_.clear();
  blocks_.clear();
  ClearChanges();
  ++edit_count_;
}

}  // namespace veduta
