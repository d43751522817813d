// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/mapper.h"

#include <algorithm>
#include <map>
#include <set>

#include "engine/ingest/merge_candidates.h"
#include "engine/ingest/pair_verifier.h"
#include "engine/matching/two_view.h"
#include "storage/base/content_hash.h"
#include "storage/base/stopwatch.h"

namespace veduta {
namespace {

MapImage ToMapImage(const ImageFeatures& photo) {
  MapImage image;
  image.id = photo.id;
  image.camera = photo.camera;
  image.width_px = photo.width_px;
  image.height_px = photo.height_px;
  image.features = photo.features;
  image.grid = photo.grid;
  image.points.resize(photo.features->size());
  return image;
}

// The pose that the points now joined give: epipolar lines are drawn from it next.
void RefineByPoints(Map* map, ImageId id, double error_px_max) {
  const MapImage& image = map->image(id);
  std::vector<Eigen::Vector2d> x;
  std::vector<Eigen::Vector3d> points;
  for (FeatureIndex f = 0; f < image.points.size(); ++f) {
    const PointRecord* point = image.points[f].valid() ? map->FindPoint(image.points[f]) : nullptr;
    if (point == nullptr) continue;
    x.push_back(image.camera.Normalize(image.features->keypoints[f]));
    points.push_back(point->position);
  }
  if (x.size() >= 6)
    map->SetPose(id, RefinePose(image.cam_from_world, x, points,
                                0.5 * error_px_max / image.camera.focal_px()));
}

// Those of a placed image's matches with images of its reconstruction that lie by the epipolar
// lines of their poses.
std::vector<PairMatches> KeepAgreeing(const Map& map, ImageId id,
                                      std::span<const PairMatches> putative, double error_px_max) {
  const MapImage& image = map.image(id);
  std::vector<PairMatches> agreeing;
  for (const PairMatches& pair : putative) {
    const MapImage& other = map.image(pair.other);
    if (other.reconstruction != image.reconstruction) continue;
    const Eigen::Matrix3d essential =
        EssentialFromPose(other.cam_from_world * image.cam_from_world.Inverse());
    const double distance_max =
        error_px_max / std::min(image.camera.focal_px(), other.camera.focal_px());
    agreeing.push_back({pair.other, pair.geometry, pair.other_from_photo, {}});
    for (const FeatureMatch& m : pair.matches) {
      const Eigen::Vector2d x = image.camera.Normalize(image.features->keypoints[m.a]);
      const Eigen::Vector2d x_other = other.camera.Normalize(other.features->keypoints[m.b]);
      if (SampsonDistance(essential, x, x_other) < distance_max)
        agreeing.back().matches.push_back(m);
    }
  }
  return agreeing;
}

std::string Of(size_t part, size_t whole) {
  return std::to_string(part) + " of " + std::to_string(whole);
}

}  // namespace

Result<std::vector<PairMatches>> Mapper::MatchAgain(const ImageFeatures& photo,
                                                    std::span<const PairMatches> pairs) {
  std::vector<PairMatches> putative;
  for (const PairMatches& pair : pairs) {
    if (map_->HasImage(pair.other))
      putative.push_back({pair.other, pair.geometry, pair.other_from_photo, {}});
  }
  std::vector<Status> statuses(putative.size());
  pool_->ParallelFor(putative.size(), [&](size_t i) {
    const auto other = loader_->features()->Get(loader_->snapshot(), putative[i].other);
    if (!other.ok()) {
      statuses[i] = other.status();
      return;
    }
    MatchOptions match;
    match.ratio_max = options_.putative_ratio_max;
    for (const DescriptorMatch& m : MatchImages(photo, **other, match)) {
      putative[i].matches.push_back({m.a, m.b});
    }
  });
  for (const Status& status : statuses) VEDUTA_RETURN_IF_ERROR(status);
  return putative;
}

std::vector<Mapper::Candidate> Mapper::FindPlacements(const ImageFeatures& photo,
                                                      std::span<const PairMatches> pairs,
                                                      std::span<const PairMatches> putative,
                                                      uint64_t seed, Placement* placement) {
  std::set<ReconstructionId> reconstructions;
  for (const PairMatches& pair : pairs) {
    if (map_->HasImage(pair.other)) reconstructions.insert(map_->image(pair.other).reconstruction);
  }
  std::vector<Candidate> found;
  for (const ReconstructionId id : reconstructions) {
    Candidate candidate{
        id, {}, GatherStructure(*map_, id, *photo.features, photo.camera, putative), {}, false};
    candidate.resection =
        Resect(candidate.structure.x, candidate.structure.positions, photo.camera.focal_px(),
               MixSeed(seed, id.value), options_.resection);
    if (candidate.resection.outcome != ResectionOutcome::kPlaced)
      ResectAlongNeighbor(photo, pairs, &candidate);
    const size_t inliers = candidate.resection.inliers.size(),
                 points = candidate.structure.x.size();
    const std::string where = " points of reconstruction " + std::to_string(id.value);
    if (candidate.resection.outcome == ResectionOutcome::kTooFewMatches) {
      if (placement->reason == Reason::kNone) {
        placement->reason = Reason::kTooFewStructurePoints;
        placement->detail = "sees " + std::to_string(points) + where + "; " +
                            std::to_string(options_.resection.inlier_count_min) + " are needed";
      }
      continue;
    }
    if (candidate.resection.outcome == ResectionOutcome::kTooFewInliers) {
      placement->reason = Reason::kResectionFailed;
      placement->detail = inliers > 0
                              ? "no pose explains more than " + Of(inliers, points) + where
                              : "no pose explains even a few of " + std::to_string(points) + where;
      continue;
    }
    const NeighborAgreement agreement =
        CheckNeighbors(*map_, id, candidate.resection.cam_from_world, *photo.features, photo.camera,
                       pairs, options_.neighbor_error_px_max);
    if (static_cast<double>(agreement.contradicting_matches) >
        options_.contradiction_share_max * static_cast<double>(agreement.agreeing_matches)) {
      placement->reason = Reason::kContradictsNeighbors;
      placement->detail = "the pose by " + Of(inliers, points) + where + " contradicts " +
                          Of(agreement.contradicting_images,
                             agreement.contradicting_images + agreement.agreeing_images) +
                          " verified neighbours";
      continue;
    }
    candidate.weak = !candidate.along.valid() && IsWeak(inliers, pairs);
    if (candidate.weak) {
      placement->reason = Reason::kTooFewStructurePoints;
      placement->detail =
          "a pose by only " + Of(inliers, points) + where +
          ", while most of its verified matches lead to photos that are not placed yet";
    }
    found.push_back(std::move(candidate));
  }
  std::stable_sort(found.begin(), found.end(), [](const Candidate& a, const Candidate& b) {
    return a.weak != b.weak ? b.weak : a.resection.inliers.size() > b.resection.inliers.size();
  });
  return found;
}

void Mapper::ResectAlongNeighbor(const ImageFeatures& photo, std::span<const PairMatches> pairs,
                                 Candidate* candidate) const {
  const PairMatches* best = nullptr;
  for (const PairMatches& pair : pairs) {
    if (pair.geometry != PairGeometry::kGeneral ||
        pair.matches.size() < options_.neighbor_match_count_min || !map_->HasImage(pair.other) ||
        map_->image(pair.other).reconstruction != candidate->reconstruction) {
      continue;
    }
    if (best == nullptr || pair.matches.size() > best->matches.size()) best = &pair;
  }
  if (best == nullptr) return;
  const Resection found =
      ResectAlong(best->other_from_photo.Inverse(), map_->image(best->other).cam_from_world,
                  candidate->structure.x, candidate->structure.positions, photo.camera.focal_px(),
                  options_.along_neighbor);
  if (found.outcome != ResectionOutcome::kPlaced) return;
  candidate->resection = found;
  candidate->along = best->other;
}

// A few points may agree on repeated texture alone. Where other neighbours, not placed yet, share
// more with the photo, they had better be heard first: with them it may found a reconstruction, and
// merging takes more than a few points.
bool Mapper::IsWeak(size_t inlier_count, std::span<const PairMatches> pairs) const {
  if (inlier_count >= options_.sure_inlier_count) return false;
  size_t unplaced_matches = 0;
  for (const PairMatches& pair : pairs) {
    if (!map_->HasImage(pair.other)) unplaced_matches += pair.matches.size();
  }
  return unplaced_matches > inlier_count;
}

std::vector<ImageId> Mapper::CovisibleImages(ImageId image, size_t count_max) const {
  std::map<ImageId, uint32_t> shared;
  for (const PointId id : map_->image(image).points) {
    const PointRecord* point = id.valid() ? map_->FindPoint(id) : nullptr;
    if (point == nullptr) continue;
    for (const TrackElement& element : point->track) {
      if (element.image != image) ++shared[element.image];
    }
  }
  std::vector<std::pair<ImageId, uint32_t>> ranked(shared.begin(), shared.end());
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  if (ranked.size() > count_max) ranked.resize(count_max);
  std::vector<ImageId> images;
  for (const auto& [id, count] : ranked) images.push_back(id);
  return images;
}

void Mapper::PlaceInto(const ImageFeatures& photo, std::span<const PairMatches> putative,
                       const Candidate& candidate) {
  MapImage image = ToMapImage(photo);
  image.reconstruction = candidate.reconstruction;
  image.cam_from_world = candidate.resection.cam_from_world;
  map_->PlaceImage(std::move(image));
  const std::vector<PairMatches> agreeing =
      KeepAgreeing(*map_, photo.id, putative, options_.growth.error_px_max);
  GrowFromMatches(map_, photo.id, agreeing, options_.growth);
  RefineByPoints(map_, photo.id, options_.growth.error_px_max);
}

Status Mapper::GrowAround(ImageId image) {
  const std::vector<ImageId> near = CovisibleImages(image, options_.local_images_max);
  VEDUTA_RETURN_IF_ERROR(loader_->LoadNeighborhood(near));
  std::vector<PairMatches> guided(std::min<size_t>(near.size(), options_.guided_images_max));
  pool_->ParallelFor(guided.size(), [&](size_t i) {
    guided[i] = MatchPlaced(*map_, image, near[i], options_.growth);
  });
  GrowthOptions growth = options_.growth;
  growth.views_min = options_.growth.guided_views_min;
  GrowFromMatches(map_, image, guided, growth);
  GrowByProjection(map_, image, map_->PointsSeenBy(near), options_.growth);
  const ImageId self[] = {image};
  const std::vector<PointId> own = map_->PointsSeenBy(self);
  for (const ImageId id : near) GrowByProjection(map_, id, own, options_.growth);
  return Status::Ok();
}

Status Mapper::AdjustAround(ImageId image, size_t images_max) {
  std::vector<ImageId> free = CovisibleImages(image, images_max - 1);
  free.push_back(image);
  std::sort(free.begin(), free.end());
  VEDUTA_RETURN_IF_ERROR(loader_->LoadNeighborhood(free));
  const std::vector<PointId> points = map_->PointsSeenBy(free);
  VEDUTA_ASSIGN_OR_RETURN(const BundleSummary summary,
                          AdjustBundle(map_, free, points, options_.local_bundle, pool_));
  FilterPoints(map_, points, options_.filter);
  return summary.observations > 0 ? Status::Ok() : Status::InvalidArgument("nothing to adjust");
}

Status Mapper::TryMerges(std::span<const ImageId> near, std::span<const PairMatches> pairs,
                         uint64_t seed, Placement* placement) {
  const ImageId photo = placement->placed.front();
  VEDUTA_ASSIGN_OR_RETURN(const auto common, FindCommonPoints(loader_, *map_, near, photo, pairs));
  for (auto [other, points] : common) {
    // An earlier merge may have made two points one.
    std::erase_if(points, [&](const PointPair& pair) {
      return !map_->FindPoint(pair.into) || !map_->FindPoint(pair.from);
    });
    VEDUTA_ASSIGN_OR_RETURN(const bool merged,
                            TryMerge(points, other, MixSeed(seed, other.value), placement));
    if (!merged) continue;
    placement->verdict = Verdict::kMerged;
    placement->reason = Reason::kJoinedReconstructions;
    placement->detail +=
        "; reconstructions " + std::to_string(placement->merges.back().from.value) + " and " +
        std::to_string(placement->reconstruction.value) + " merged by " +
        std::to_string(placement->merges.back().common_point_count) + " common points";
  }
  return Status::Ok();
}

Result<bool> Mapper::TryMerge(std::span<const PointPair> common, ReconstructionId other,
                              uint64_t seed, Placement* placement) {
  const auto alignment =
      AlignPoints(*map_, common, options_.merge_error_px_max, options_.common_points_min, seed);
  if (!alignment) return false;
  // The photo's reconstruction gives way to a larger one, unless others were merged into it just
  // now.
  Merge merge{other, alignment->into_from, static_cast<uint32_t>(alignment->agreeing.size())};
  ReconstructionId into = placement->reconstruction;
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord other_record,
                          loader_->GetReconstruction(other));
  uint32_t own_count = static_cast<uint32_t>(placement->placed.size());
  if (placement->founded != into) {
    VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord own_record,
                            loader_->GetReconstruction(into));
    own_count += own_record.image_count;
  }
  if (placement->merges.empty() && other_record.image_count > own_count) {
    merge = {into, alignment->into_from.Inverse(), merge.common_point_count};
    into = other;
  }
  std::vector<ImageId> members;
  if (merge.from != placement->founded)
    VEDUTA_RETURN_IF_ERROR(loader_->LoadReconstruction(merge.from, &members));
  std::set<ImageId> moved(members.begin(), members.end());
  for (const ImageId id : placement->placed) {
    if (map_->image(id).reconstruction == merge.from) moved.insert(id);
  }
  for (const ImageId id : moved) {
    map_->MoveImage(id, into, merge.into_from);
    map_->MoveBlock(id, into, merge.into_from);
  }
  for (const PointPair& pair : alignment->agreeing) {
    TryMergePoints(map_, pair.into, pair.from, options_.growth.error_px_max);
  }
  placement->reconstruction = into;
  placement->merges.push_back(merge);
  return true;
}

Status Mapper::TryFound(const ImageFeatures& photo, std::span<const PairMatches> pairs,
                        ReconstructionId id, uint64_t seed, Placement* placement) {
  VEDUTA_ASSIGN_OR_RETURN(
      const FoundingViews views,
      GatherFoundingViews(loader_, *map_, photo, pairs, options_.founding_views_max));
  const bool has_placed_neighbor = placement->reason != Reason::kNone;
  FoundingOutcome outcome = FoundingOutcome::kNoPair;
  Map triple;
  if (views.images.size() >= 3)
    outcome = Found(views, photo.id, id, seed, options_.founding, &triple);
  if (outcome != FoundingOutcome::kFounded) {
    if (has_placed_neighbor) return Status::Ok();
    placement->reason = Reason::kNoGoodTriple;
    placement->detail = std::to_string(pairs.size()) + " verified neighbours, none placed, and ";
    placement->detail += views.images.size() < 3 ? "three views are needed to start"
                         : outcome == FoundingOutcome::kNoPair
                             ? "no two of the views have enough parallax"
                         : outcome == FoundingOutcome::kNoThirdView
                             ? "no third view sees the points of the best pair"
                             : "too few points common to three views";
    return Status::Ok();
  }
  for (const auto& [image_id, image] : triple.images()) {
    MapImage placed = image;
    placed.points.assign(placed.features->size(), PointId{});
    map_->PlaceImage(std::move(placed));
    placement->placed.push_back(image_id);
  }
  const std::vector<PointId> points = triple.PointsSeenBy(placement->placed);
  for (const PointId point : points)
    map_->AddPoint(photo.id, triple.point(point).position, triple.point(point).track);
  for (const ImageId image_id : placement->placed) VEDUTA_RETURN_IF_ERROR(GrowAround(image_id));
  VEDUTA_RETURN_IF_ERROR(AdjustAround(photo.id, options_.local_images_max));
  placement->verdict = Verdict::kFounded;
  placement->reason = Reason::kGoodTriple;
  placement->founded = placement->reconstruction = id;
  placement->inlier_count = static_cast<uint32_t>(points.size());
  placement->detail = "founded with " + std::to_string(points.size()) + " points";
  std::swap(placement->placed.front(),
            *std::find(placement->placed.begin(), placement->placed.end(), photo.id));
  VEDUTA_RETURN_IF_ERROR(TryMerges(placement->placed, pairs, seed, placement));
  return placement->merges.empty() ? Status::Ok()
                                   : AdjustAround(photo.id, options_.local_images_max);
}

Result<Placement> Mapper::Place(const ImageFeatures& photo, std::span<const PairMatches> pairs,
                                ReconstructionId new_reconstruction, uint64_t seed) {
  Placement placement;
  Stopwatch watch;
  std::vector<ImageId> neighbors;
  for (const PairMatches& pair : pairs) neighbors.push_back(pair.other);
  VEDUTA_RETURN_IF_ERROR(loader_->LoadNeighborhood(neighbors));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairMatches> putative, MatchAgain(photo, pairs));
  std::vector<Candidate> candidates = FindPlacements(photo, pairs, putative, seed, &placement);
  if ((candidates.empty() || candidates.front().weak) && new_reconstruction.valid()) {
    VEDUTA_RETURN_IF_ERROR(TryFound(photo, pairs, new_reconstruction, seed, &placement));
  }
  std::erase_if(candidates, [&](const Candidate& c) {
    const size_t inliers = c.resection.inliers.size();
    return c.weak && (inliers < options_.weak_inlier_count_min ||
                      static_cast<double>(inliers) < options_.weak_inlier_share_min *
                                                         static_cast<double>(c.structure.x.size()));
  });
  if (candidates.empty() || placement.verdict != Verdict::kPostponed) {
    placement.map_ms = watch.LapMs();
    return placement;
  }

  PlaceInto(photo, putative, candidates.front());
  placement.verdict = Verdict::kPlaced;
  placement.reason = Reason::kRegistered;
  placement.reconstruction = candidates.front().reconstruction;
  placement.placed = {photo.id};
  placement.inlier_count = static_cast<uint32_t>(candidates.front().resection.inliers.size());
  placement.detail = "agrees with " +
                     Of(placement.inlier_count, candidates.front().structure.x.size()) + " points";
  if (candidates.front().along.valid()) {
    placement.detail +=
        ", along the baseline to image " + std::to_string(candidates.front().along.value);
  }
  std::vector<ImageId> near = CovisibleImages(photo.id, options_.local_images_max);
  VEDUTA_RETURN_IF_ERROR(TryMerges(near, pairs, seed, &placement));
  if (!placement.merges.empty()) {
    const auto agreeing = KeepAgreeing(*map_, photo.id, putative, options_.growth.error_px_max);
    GrowFromMatches(map_, photo.id, agreeing, options_.growth);
  }
  placement.map_ms = watch.LapMs();
  // Poses lead to further matches only once the verified ones have settled them: on repeated
  // texture a pose that is a little wrong finds many matches that agree with it.
  VEDUTA_RETURN_IF_ERROR(AdjustAround(photo.id, options_.settled_images_max));
  placement.adjust_ms = watch.LapMs();
  VEDUTA_RETURN_IF_ERROR(GrowAround(photo.id));
  placement.map_ms += watch.LapMs();
  VEDUTA_RETURN_IF_ERROR(AdjustAround(photo.id, options_.local_images_max));
  placement.adjust_ms += watch.LapMs();

  const auto& points = map_->image(photo.id).points;
  const size_t seen = static_cast<size_t>(
      std::count_if(points.begin(), points.end(), [](PointId id) { return id.valid(); }));
  if (seen < options_.observations_min) {
    map_->Clear();
    Placement postponed;
    postponed.reason = Reason::kResectionFailed;
    postponed.detail = "only " + std::to_string(seen) + " points are left after adjustment; " +
                       std::to_string(options_.observations_min) + " are needed";
    return postponed;
  }
  return placement;
}

Status Mapper::ReconsiderPoses(std::span<const ImageId> images) {
  std::vector<std::vector<PairMatches>> putative;
  for (const ImageId id : images) {
    VEDUTA_ASSIGN_OR_RETURN(std::vector<PairNeighbor> neighbors,
                            loader_->snapshot().ListNeighbors(id));
    std::erase_if(neighbors, [&](const PairNeighbor& n) {
      return !map_->HasImage(n.image) ||
             map_->image(n.image).reconstruction != map_->image(id).reconstruction;
    });
    std::stable_sort(
        neighbors.begin(), neighbors.end(),
        [](const PairNeighbor& a, const PairNeighbor& b) { return a.match_count > b.match_count; });
    if (neighbors.size() > options_.local_images_max) neighbors.resize(options_.local_images_max);
    std::vector<PairMatches> pairs;
    for (const PairNeighbor& neighbor : neighbors) pairs.push_back({neighbor.image, {}, {}, {}});
    VEDUTA_ASSIGN_OR_RETURN(const auto features, loader_->features()->Get(loader_->snapshot(), id));
    VEDUTA_ASSIGN_OR_RETURN(pairs, MatchAgain(*features, pairs));
    putative.push_back(std::move(pairs));
  }
  std::vector<std::optional<Resection>> better(images.size());
  pool_->ParallelFor(images.size(), [&](size_t i) {
    better[i] = FindBetterPose(*map_, images[i], putative[i], MixSeed(images[i].value, 2),
                               options_.resection);
  });
  for (size_t i = 0; i < images.size(); ++i) {
    if (!better[i]) continue;
    const ImageId self[] = {images[i]};
    for (const PointId point : map_->PointsSeenBy(self)) map_->RemoveObservation(point, images[i]);
    map_->SetPose(images[i], better[i]->cam_from_world);
    const auto agreeing = KeepAgreeing(*map_, images[i], putative[i], options_.growth.error_px_max);
    GrowFromMatches(map_, images[i], agreeing, options_.growth);
    RefineByPoints(map_, images[i], options_.growth.error_px_max);
  }
  return Status::Ok();
}

Status Mapper::AdjustReconstruction(ReconstructionId id) {
  std::vector<ImageId> images;
  VEDUTA_RETURN_IF_ERROR(loader_->LoadReconstruction(id, &images));
  VEDUTA_RETURN_IF_ERROR(ReconsiderPoses(images));
  for (int round = 0; round < 2; ++round) {
    for (const ImageId image : images) {
      GrowByProjection(map_, image,
                       map_->PointsSeenBy(CovisibleImages(image, options_.local_images_max)),
                       options_.growth);
    }
    const std::vector<PointId> points = map_->PointsSeenBy(images);
    VEDUTA_RETURN_IF_ERROR(
        AdjustBundle(map_, images, points, options_.global_bundle, pool_).status());
    FilterPoints(map_, points, options_.filter);
  }
  return Status::Ok();
}

}  // namespace veduta
