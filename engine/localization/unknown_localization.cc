// SPDX-License-Identifier: Apache-2.0
#include "engine/localization/unknown_localization.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "engine/ingest/map_loader.h"
#include "engine/ingest/neighbor_finder.h"
#include "engine/ingest/pair_verifier.h"
#include "engine/localization/copied_camera.h"
#include "engine/mapping/unknown_camera.h"
#include "engine/photo/camera_group.h"
#include "engine/photo/carried_features.h"
#include "storage/base/memory_shortage.h"
#include "storage/base/stopwatch.h"

namespace veduta {
namespace {

// Candidates whose points are asked, those with most distinctive matches first. Chosen by hand; not
// measured.
constexpr size_t kImagesMax = 16;
// Times that a photo is localised, each with the camera of the time before. Chosen by hand; not
// measured.
constexpr int kRoundsMax = 3;
// Cameras of photos that tell nothing that are tried for another such photo. Chosen by hand.
constexpr size_t kSilentMax = 3;
// By how much of the focal length, or by how many of its standard deviations, a photo alone may
// want another one than its camera has. Chosen by hand.
constexpr double kSilentFocalShare = 0.01, kSilentDeviations = 3;
// Share of the focal length by which it may change without another round. Chosen by hand; not
// measured.
constexpr double kFocalChangeMax = 0.005;

// A candidate with its distinctive matches with the photo.
struct Matched {
  ImageId image;
  std::vector<DescriptorMatch> matches;
};

// Features of the photo and points of one reconstruction, most trustworthy first.
struct Correspondences {
  std::vector<Eigen::Vector2d> x_px;
  std::vector<Eigen::Vector3d> points;
};

// A camera that explains where the photo's features are, or why there is none.
struct FoundCamera {
  std::optional<CameraModel> camera;
  Reason reason = Reason::kNone;
  std::string detail;
  std::vector<DamagedImage> damaged;  // that were passed over
};

class CameraSearch final {
 public:
  // The focal length is what the photo tells over its longer side; 0 where it tells none.
  CameraSearch(const LocalizationParts& parts, const PreparedPhoto& photo, double told_focal_share)
      : parts_(parts), photo_(photo), loader_(parts.snapshot, parts.features, &map_) {
    options_.told_focal_share = told_focal_share;
  }

  // Where `copied` is given, it receives the camera of a stored photo's copy, and no other is
  // sought.
  Result<FoundCamera> Run(std::optional<CameraRecord>* copied) {
    VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, parts_.snapshot->GetState());
    // What a photo is matched by does not depend on its camera.
    CameraModel any;
    any.width_px = photo_.width_px, any.height_px = photo_.height_px;
    any.fx = any.fy = std::max(any.width_px, any.height_px);
    VEDUTA_ASSIGN_OR_RETURN(
        const auto image,
        ImageFeatures::Make(ImageId(state.next_image), any,
                            std::make_shared<const Features>(photo_.features),
                            parts_.options.matched_count_max, ImageFeatures::Packing::kKept));
    std::vector<RankedImage> near;
    for (const ImageId id : parts_.near) near.push_back({id, 0.0});
    if (!near.empty()) {
      VEDUTA_ASSIGN_OR_RETURN(FoundCamera found, SearchAmong(*image, near, copied));
      if (found.camera || (copied != nullptr && *copied)) return found;
    }
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<RankedImage> candidates,
                            parts_.retrieval->Candidates(*parts_.snapshot, photo_.features));
    if (candidates.empty())
      return FoundCamera{{}, Reason::kNoCandidates, "nothing that is stored looks like it", {}};
    return SearchAmong(*image, candidates, copied);
  }

 private:
  Result<FoundCamera> SearchAmong(const ImageFeatures& image,
                                  std::span<const RankedImage> candidates,
                                  std::optional<CameraRecord>* copied) {
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<Matched> matched, Match(image, candidates));
    if (copied != nullptr && !matched.empty()) {
      Result<std::optional<CameraRecord>> found = FindCopied(matched.front());
      VEDUTA_RETURN_IF_ERROR(PassOverDamaged(matched.front().image, found.status()));
      if (found.ok()) *copied = std::move(*found);
      if (*copied) return FoundCamera{{}, Reason::kNone, "it is a copy of a stored photo", {}};
    }
    VEDUTA_ASSIGN_OR_RETURN(FoundCamera found, Estimate(matched));
    for (const auto& [damaged, what] : damaged_) found.damaged.push_back({damaged, what});
    return found;
  }

  Result<std::vector<Matched>> Match(const ImageFeatures& photo,
                                     std::span<const RankedImage> candidates) {
    const PairOptions& options = parts_.options.neighbors.pair;
    MatchOptions distinctive;
    distinctive.ratio_max = options.ratio_max;
    std::vector<Matched> matched(candidates.size());
    std::vector<Status> read(candidates.size());
    parts_.pool->ParallelFor(candidates.size(), [&](size_t i) {
      const auto features = parts_.features->Get(*parts_.snapshot, candidates[i].image);
      read[i] = features.status();
      if (!features.ok()) return;
      matched[i] = {candidates[i].image, MatchImages(photo, **features, distinctive)};
    });
    for (size_t i = 0; i < candidates.size(); ++i)
      VEDUTA_RETURN_IF_ERROR(PassOverDamaged(candidates[i].image, read[i]));
    std::erase_if(matched,
                  [&](const Matched& m) { return m.matches.size() < options.distinct_count_min; });
    std::ranges::stable_sort(matched, std::greater<>(),
                             [](const Matched& m) { return m.matches.size(); });
    if (matched.size() > kImagesMax) matched.resize(kImagesMax);
    return matched;
  }

  // A copy has nearly all of its matches with the photo that it is of.
  Result<std::optional<CameraRecord>> FindCopied(const Matched& best) const {
    std::vector<FeatureMatch> matches;
    for (const DescriptorMatch& match : best.matches) matches.push_back({match.a, match.b});
    return FindCopiedCamera(parts_, photo_, best.image, matches);
  }

  // What the photo sees of each reconstruction, by the points of the images that it matches.
  std::map<ReconstructionId, Correspondences> Gather(std::span<const Matched> matched) const {
    struct Candidate {
      double ratio;
      FeatureIndex feature;
      PointId point;
    };
    std::map<ReconstructionId, std::vector<Candidate>> found;
    for (const auto& [id, matches] : matched) {
      if (!map_.HasImage(id)) continue;
      const MapImage& image = map_.image(id);
      for (const DescriptorMatch& match : matches) {
        const PointId point = image.points[match.b];
        if (!point.valid() || map_.FindPoint(point) == nullptr) continue;
        found[image.reconstruction].push_back(
            {match.distance_squared / std::max(1.0, double(match.second_distance_squared)), match.a,
             point});
      }
    }
    std::map<ReconstructionId, Correspondences> seen;
    for (auto& [reconstruction, candidates] : found) {
      std::ranges::sort(candidates, [](const Candidate& a, const Candidate& b) {
        return std::tie(a.ratio, a.feature, a.point) < std::tie(b.ratio, b.feature, b.point);
      });
      std::set<std::pair<FeatureIndex, PointId>> known;
      Correspondences& all = seen[reconstruction];
      for (const Candidate& c : candidates) {
        if (!known.insert({c.feature, c.point}).second) continue;
        const Keypoint& keypoint = photo_.features.keypoints[c.feature];
        all.x_px.emplace_back(keypoint.x_px, keypoint.y_px);
        all.points.push_back(map_.point(c.point).position);
      }
    }
    return seen;
  }

  // The camera by which the photo sees most of a reconstruction.
  Result<FoundCamera> Estimate(std::span<const Matched> matched) {
    if (matched.empty()) {
      return FoundCamera{{},
                         Reason::kNoVerifiedNeighbor,
                         "nothing that looks like it shares enough distinctive features with it",
                         {}};
    }
    for (const Matched& m : matched)
      VEDUTA_RETURN_IF_ERROR(PassOverDamaged(m.image, loader_.LoadStructure({&m.image, 1})));
    FoundCamera best{
        {}, Reason::kTooFewStructurePoints, "none of what looks like it has a pose", {}};
    size_t inliers = 0;
    for (const auto& [reconstruction, seen] : Gather(matched)) {
      const UnknownCameraResection found = ResectUnknownCamera(
          seen.x_px, seen.points, photo_.width_px, photo_.height_px, photo_.hash.Seed(), options_);
      if (found.outcome == ResectionOutcome::kPlaced && found.inliers.size() > inliers) {
        inliers = found.inliers.size();
        best = {found.camera, Reason::kNone, {}, {}};
      } else if (inliers == 0) {
        best = {{},
                Reason::kResectionFailed,
                "no pose and focal length explain enough of " + std::to_string(seen.points.size()) +
                    " points",
                {}};
      }
    }
    return best;
  }

  // Notes a candidate that is damaged; returns what fails for everybody.
  Status PassOverDamaged(ImageId image, const Status& status) {
    if (!IsCandidateDamaged(status)) return status;
    damaged_.emplace(image, status.message());
    return Status::Ok();
  }

  const LocalizationParts& parts_;
  const PreparedPhoto& photo_;
  UnknownCameraOptions options_;
  CityMap map_;
  MapLoader loader_;
  std::map<ImageId, std::string> damaged_;
};

LocalizedPhoto Refused(const PreparedPhoto& photo, FoundCamera found) {
  LocalizedPhoto refused;
  refused.name = photo.name;
  refused.verdict = Verdict::kPostponed;
  refused.reason = found.reason;
  refused.detail = std::move(found.detail);
  refused.damaged = std::move(found.damaged);
  refused.times.decode_ms = photo.decode_ms;
  refused.times.features_ms = photo.features_ms;
  return refused;
}

// The camera that the same bytes are stored with, where they are.
Result<std::optional<CameraRecord>> FindStoredCamera(const Snapshot& snapshot,
                                                     const ContentHash& hash) {
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<ImageId> stored, snapshot.FindImageByPhoto(hash));
  if (!stored) return std::optional<CameraRecord>();
  VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, snapshot.GetImage(*stored));
  VEDUTA_ASSIGN_OR_RETURN(CameraRecord camera, snapshot.GetCamera(image.camera));
  return std::optional(std::move(camera));
}

// Cameras that photos of the size have told together which tell nothing of themselves.
Result<std::vector<CameraRecord>> ListSilentCameras(const Snapshot& snapshot,
                                                    const ImageSize& size) {
  VEDUTA_ASSIGN_OR_RETURN(std::vector<CameraRecord> cameras, snapshot.ListCameras());
  std::erase_if(cameras, [&](const CameraRecord& camera) {
    return !camera.is_refinable || camera.model.width_px != size.width_px ||
           camera.model.height_px != size.height_px ||
           !IsNumberedName(camera.name, SilentGroupOf(size));
  });
  if (cameras.size() > kSilentMax) cameras.resize(kSilentMax);
  return cameras;
}

struct LocalizedByCamera {
  LocalizedPhoto photo;
  CameraRecord camera;
};

// Whether the photo, whose lens was estimated, wants the focal length that the camera has.
bool WantsFocalOf(const CameraRecord& camera, const LocalizedPhoto& estimated) {
  if (!estimated.camera) return false;
  const EstimatedCamera& own = *estimated.camera;
  return std::abs(std::log(own.model.fx / camera.model.fx)) <=
         std::max(kSilentFocalShare, kSilentDeviations * own.focal_stddev_share);
}

// By the one of these cameras that explains most of what the photo sees, as well as one of its own
// would: of a photo that does not say which camera took it.
Result<std::optional<LocalizedByCamera>> LocalizeBySilent(const LocalizationParts& parts,
                                                          const PhotoPreparer& preparer,
                                                          const PhotoSource& source,
                                                          const ImageSize& size) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<CameraRecord> cameras,
                          ListSilentCameras(*parts.snapshot, size));
  std::optional<LocalizedByCamera> best;
  for (const CameraRecord& camera : cameras) {
    PreparedPhoto photo = ExtractCarried(preparer, source, camera);
    if (!photo.failure.ok()) return photo.failure;
    PreparedPhoto same;  // of which localising wants these
    same.name = photo.name;
    same.hash = photo.hash;
    same.width_px = photo.width_px, same.height_px = photo.height_px;
    same.features = photo.features;
    VEDUTA_ASSIGN_OR_RETURN(LocalizedPhoto by_camera,
                            LocalizePhoto(parts, std::move(photo), camera.model));
    if (by_camera.verdict != Verdict::kPlaced) continue;
    if (best && best->photo.inlier_count >= by_camera.inlier_count) continue;
    VEDUTA_ASSIGN_OR_RETURN(
        const LocalizedPhoto alone,
        LocalizePhoto(parts, std::move(same), camera.model, Lens::kEstimated, 0));
    // One that tells no focal length of its own may be a part of a photo, or of another camera.
    if (WantsFocalOf(camera, alone)) best = {std::move(by_camera), camera};
  }
  return best;
}

Result<LocalizedPhoto> Localize(const LocalizationParts& parts, const PhotoPreparer& preparer,
                                const PhotoSource& source, std::optional<CameraRecord>* known) {
  PreparedPhoto photo = preparer.Extract(source, std::nullopt);
  if (!photo.failure.ok()) return photo.failure;
  if (photo.reason != Reason::kNone) return LocalizePhoto(parts, std::move(photo), CameraModel());
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<CameraRecord> stored,
                          FindStoredCamera(*parts.snapshot, photo.hash));
  if (stored) {
    PreparedPhoto again = ExtractCarried(preparer, source, *stored);
    if (!again.failure.ok()) return again.failure;
    return LocalizePhoto(parts, std::move(again), stored->model);
  }
  Stopwatch watch;
  VEDUTA_ASSIGN_OR_RETURN(const PhotoFacts facts, preparer.Look(source));
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<CameraRecord> of_group,
                          FindGroupCamera(*parts.snapshot, facts.camera_group, facts.focal_share));
  if (of_group) {
    PreparedPhoto with = ExtractCarried(preparer, source, *of_group);
    if (!with.failure.ok()) return with.failure;
    VEDUTA_ASSIGN_OR_RETURN(LocalizedPhoto by_group,
                            LocalizePhoto(parts, std::move(with), of_group->model));
    if (by_group.verdict == Verdict::kPlaced) return by_group;
  }
  if (facts.camera_group.empty() && !facts.is_upside_down) {
    VEDUTA_ASSIGN_OR_RETURN(
        std::optional<LocalizedByCamera> silent,
        LocalizeBySilent(parts, preparer, source, {photo.width_px, photo.height_px}));
    if (silent) {
      if (known != nullptr) *known = std::move(silent->camera);
      return std::move(silent->photo);
    }
  }
  const double told_share = facts.focal_share.value_or(0),
               told_px = told_share * std::max(photo.width_px, photo.height_px);
  // Here its pixels are upright, and it is stored as it is: with another camera.
  if (facts.is_upside_down) known = nullptr;
  VEDUTA_ASSIGN_OR_RETURN(FoundCamera found, CameraSearch(parts, photo, told_share).Run(known));
  const double search_ms = watch.LapMs();
  LocalizedPhoto localized;
  if (!found.camera) {
    localized = Refused(photo, std::move(found));
    localized.times.map_ms = search_ms;
    localized.times.total_ms = search_ms + photo.decode_ms + photo.features_ms;
    return localized;
  }
  CameraModel camera = *found.camera;
  for (int round = 0; round < kRoundsMax; ++round) {
    PreparedPhoto straight = preparer.Extract(source, camera);
    if (!straight.failure.ok()) return straight.failure;
    VEDUTA_ASSIGN_OR_RETURN(
        localized, LocalizePhoto(parts, std::move(straight), camera, Lens::kEstimated, told_px));
    if (!localized.camera) break;
    const double change = std::abs(localized.camera->model.fx / camera.fx - 1);
    camera = localized.camera->model;
    if (change <= kFocalChangeMax) break;
  }
  localized.times.map_ms += search_ms;
  localized.times.total_ms = watch.LapMs() + search_ms + photo.decode_ms + photo.features_ms;
  return localized;
}

}  // namespace

Result<LocalizedPhoto> LocalizeUnknown(const LocalizationParts& parts,
                                       const PhotoPreparer& preparer, const PhotoSource& source,
                                       std::optional<CameraRecord>* known) {
  return CatchShortage("localise the photo",
                       [&] { return Localize(parts, preparer, source, known); });
}

}  // namespace veduta
