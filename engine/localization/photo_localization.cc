// SPDX-License-Identifier: Apache-2.0
#include "engine/localization/photo_localization.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/camera/projection.h"
#include "engine/ingest/believed_pose.h"
#include "engine/ingest/forbidding.h"
#include "engine/ingest/misplaced.h"
#include "engine/ingest/photo_locator.h"
#include "engine/ingest/surroundings.h"
#include "engine/mapping/bundle_adjustment.h"
#include "engine/mapping/covisible_images.h"
#include "engine/mapping/network_covariance.h"
#include "engine/mapping/unknown_camera.h"
#include "engine/photo/camera_group.h"
#include "engine/query/city_answers.h"
#include "engine/query/forbidden.h"
#include "engine/query/pose_uncertainty.h"
#include "engine/query/unsure_poses.h"
#include "storage/base/memory_shortage.h"
#include "storage/base/stopwatch.h"

namespace veduta {
namespace {

// Images among which it is told how sure a pose is. Chosen by hand; not measured.
constexpr uint32_t kNetworkImagesMax = 20;
// Standard deviation of an estimated focal length, over itself, up to which a pose is believed: the
// photo is off by about as much of how far it sees. Chosen by hand; not measured.
constexpr double kFocalDeviationShareMax = 0.05;

// As when the photo is added, with all other poses held. Returns the photo postponed where its pose
// is not believed.
Result<std::optional<Placement>> PlaceAmongHeld(const MappingContext& context,
                                                const ImageFeatures& photo,
                                                const PoseCandidate& pose,
                                                std::span<const PairMatches> putative) {
  VEDUTA_ASSIGN_OR_RETURN(std::optional<Placement> refused,
                          EnterPose(context, photo, pose, putative));
  if (refused) return refused;
  VEDUTA_RETURN_IF_ERROR(AdjustAround(context, photo.id, 1));
  VEDUTA_RETURN_IF_ERROR(GrowAround(context, photo.id));
  VEDUTA_RETURN_IF_ERROR(AdjustAround(context, photo.id, 1));
  VEDUTA_ASSIGN_OR_RETURN(refused, AskWhatIsMissing(context, photo.id));
  return refused ? refused : AskHowMuchItSees(context, photo.id);
}

// The photo postponed, where most of its neighbours stand in other reconstructions than its pose.
Result<std::optional<Placement>> AskWhereNeighborsStand(const MappingContext& context,
                                                        ImageId photo,
                                                        std::span<const PairMatches> pairs) {
  const ReconstructionId own = context.map->image(photo).reconstruction;
  size_t beside = 0, elsewhere = 0;
  for (const PairMatches& pair : pairs) {
    VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose,
                            context.loader->snapshot().FindPose(pair.other));
    if (pose) pose->reconstruction == own ? ++beside : ++elsewhere;
  }
  if (!IsMostlyElsewhere(beside, elsewhere)) return std::optional<Placement>();
  return std::optional(
      Postponed(Reason::kAmbiguous, "it shows what looks alike at many places: of its neighbours " +
                                        std::to_string(beside) + " stand in reconstruction " +
                                        std::to_string(own.value) + " and " +
                                        std::to_string(elsewhere) + " in others"));
}

// The photo postponed, where it may stand as well at a place that looks like that of its pose: on
// the other side of the seam of a merge that is refused because the two show different places.
Result<std::optional<Placement>> AskWhichSide(const MappingContext& context, ImageId photo,
                                              std::span<const PairMatches> pairs) {
  const ReconstructionId own = context.map->image(photo).reconstruction;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<HypothesisRecord> hypotheses,
                          context.loader->snapshot().ListHypotheses());
  for (const HypothesisRecord& hypothesis : hypotheses) {
    if (!TellsPlacesApart(hypothesis.reason) || (hypothesis.a != own && hypothesis.b != own))
      continue;
    const ReconstructionId other = hypothesis.a == own ? hypothesis.b : hypothesis.a;
    SideDoubts doubts;
    VEDUTA_RETURN_IF_ERROR(WeighSide(context, photo, pairs, other, &doubts));
    if (doubts.misplaced.empty() && doubts.unsure.empty()) continue;
    return std::optional(Postponed(
        Reason::kAmbiguous, "it may stand in reconstruction " + std::to_string(own.value) + " or " +
                                std::to_string(other.value) + ", which look alike there"));
  }
  return std::optional<Placement>();
}

// Gives the photo a pose in the map, or says why not and leaves the map empty.
Result<Placement> GivePose(const MappingContext& context, const ImageFeatures& photo,
                           std::span<const PairMatches> pairs, uint64_t seed) {
  Stopwatch watch;
  VEDUTA_ASSIGN_OR_RETURN(const bool is_forbidden,
                          IsPoseForbidden(context.loader->snapshot(), photo.id));
  if (is_forbidden) return Postponed(Reason::kForbidden, kPoseForbiddenDetail);
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairMatches> allowed,
                          WithoutForbidden(context.loader->snapshot(), pairs));
  VEDUTA_ASSIGN_OR_RETURN(const SoughtPoses sought, SeekPoses(context, photo, allowed, seed));
  Placement placement = Postponed(sought.search.reason, sought.search.detail);
  if (sought.putative.empty()) {
    placement =
        Postponed(Reason::kTooFewStructurePoints, "none of its " + std::to_string(pairs.size()) +
                                                      " verified neighbours has a pose");
  }
  VEDUTA_ASSIGN_OR_RETURN(const PoseCandidate* const pose,
                          ChoosePose(context, photo, sought.search.found));
  if (pose != nullptr) {
    VEDUTA_ASSIGN_OR_RETURN(std::optional<Placement> refused,
                            PlaceAmongHeld(context, photo, *pose, sought.putative));
    if (!refused) {
      VEDUTA_ASSIGN_OR_RETURN(refused, AskWhereNeighborsStand(context, photo.id, allowed));
    }
    if (!refused) {
      VEDUTA_ASSIGN_OR_RETURN(refused, AskWhichSide(context, photo.id, allowed));
    }
    placement = refused ? std::move(*refused) : PlacedAt(photo, *pose);
  }
  if (placement.verdict == Verdict::kPostponed) context.map->Clear();
  placement.map_ms = watch.LapMs();
  return placement;
}

// The images that share points with a placed one, those with most first, then ascending ids.
Result<std::vector<SupportAnswer>> SupportOf(const Snapshot& snapshot, const CityMap& map,
                                             ImageId image) {
  std::map<ImageId, uint32_t> counts;
  for (const PointId id : map.PointsSeenBy({&image, 1})) {
    for (const TrackElement& element : map.point(id).track) {
      if (element.image != image) ++counts[element.image];
    }
  }
  std::vector<SupportAnswer> support;
  for (const auto& [other, count] : counts) {
    VEDUTA_ASSIGN_OR_RETURN(ImageRecord record, snapshot.GetImage(other));
    support.push_back({other, std::move(record.name), count});
  }
  std::ranges::stable_sort(support, std::ranges::greater(), &SupportAnswer::points);
  return support;
}

// One photo on its way.
class Localization final {
 public:
  Localization(const LocalizationParts& parts, const CameraModel& camera, Lens lens,
               double told_focal_px)
      : parts_(parts),
        camera_(camera),
        lens_(lens),
        told_focal_px_(told_focal_px),
        loader_(parts.snapshot, parts.features, &map_) {}

  Result<LocalizedPhoto> Run(PreparedPhoto photo) {
    answer_.name = photo.name;
    answer_.times.decode_ms = photo.decode_ms;
    answer_.times.undistort_ms = photo.undistort_ms;
    answer_.times.features_ms = photo.features_ms;
    answer_.reason = photo.reason;
    answer_.detail = photo.detail;
    answer_.verdict = photo.reason == Reason::kNone ? Verdict::kPostponed : Verdict::kRejected;
    Stopwatch watch;
    if (answer_.verdict != Verdict::kRejected) VEDUTA_RETURN_IF_ERROR(Localize(std::move(photo)));
    answer_.times.total_ms = watch.LapMs() + answer_.times.decode_ms + answer_.times.undistort_ms +
                             answer_.times.features_ms;
    return std::move(answer_);
  }

 private:
  Status Localize(PreparedPhoto photo) {
    const Snapshot& snapshot = *parts_.snapshot;
    VEDUTA_ASSIGN_OR_RETURN(const std::optional<ImageId> stored,
                            snapshot.FindImageByPhoto(photo.hash));
    if (stored) answer_.stored = *stored;
    std::optional<PoseRecord> pose;
    if (stored) {
      VEDUTA_ASSIGN_OR_RETURN(pose, snapshot.FindPose(*stored));
    }
    if (pose) return AnswerStored(*pose);
    VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, snapshot.GetState());
    return Search(stored.value_or(ImageId(state.next_image)), std::move(photo));
  }

  Status AnswerStored(const PoseRecord& pose) {
    VEDUTA_ASSIGN_OR_RETURN(const ImageRecord record, parts_.snapshot->GetImage(pose.image));
    answer_.detail = "the same bytes are stored as " + record.name;
    VEDUTA_ASSIGN_OR_RETURN(const auto unsure, Unsure());
    if (const auto found = unsure->find(pose.image); found != unsure->end()) {
      const bool is_own = found->second.front() == pose.reconstruction;
      answer_.verdict = Verdict::kPostponed;
      answer_.reason = Reason::kAmbiguous;
      answer_.detail += ", which may stand in reconstruction " +
                        std::to_string(pose.reconstruction.value) + " or " +
                        (is_own ? "elsewhere in it" : std::to_string(found->second.front().value));
      return Status::Ok();
    }
    VEDUTA_RETURN_IF_ERROR(loader_.LoadNeighborhood({&pose.image, 1}));
    answer_.verdict = Verdict::kPlaced;
    answer_.reason = Reason::kRegistered;
    answer_.inlier_count = static_cast<uint32_t>(map_.PointsSeenBy({&pose.image, 1}).size());
    return Describe(pose.image);
  }

  Status Search(ImageId id, PreparedPhoto photo) {
    Stopwatch watch;
    const uint64_t seed = photo.hash.Seed();
    const auto features = std::make_shared<const Features>(std::move(photo.features));
    VEDUTA_ASSIGN_OR_RETURN(const auto image, ImageFeatures::Make(id, camera_, features,
                                                                  parts_.options.matched_count_max,
                                                                  ImageFeatures::Packing::kKept));
    const MappingContext context{&loader_, &map_, parts_.pool, parts_.options.mapper};
    const PoseGiver give_pose = [&](const ImageFeatures& seen, std::span<const PairMatches> pairs) {
      return GivePose(context, seen, pairs, seed);
    };
    VEDUTA_ASSIGN_OR_RETURN(const bool is_near, SearchNear(context, *image, give_pose, seed));
    if (!is_near) {
      watch.LapMs();
      VEDUTA_ASSIGN_OR_RETURN(const std::vector<RankedImage> candidates,
                              parts_.retrieval->Candidates(*parts_.snapshot, *features));
      answer_.times.retrieve_ms = watch.LapMs();
      VEDUTA_ASSIGN_OR_RETURN(
          const LocatedPhoto located,
          LocatePhoto(context, parts_.options, *image, camera_, candidates, give_pose, seed));
      NoteSearch(located);
    }
    if (answer_.verdict != Verdict::kPlaced) return Status::Ok();
    VEDUTA_RETURN_IF_ERROR(Describe(id));
    return AskWhetherUnsure();
  }

  // Whether the photo has a sure pose by the images near which it was taken.
  Result<bool> SearchNear(const MappingContext& context, const ImageFeatures& image,
                          const PoseGiver& give_pose, uint64_t seed) {
    if (parts_.near.empty()) return false;
    std::vector<RankedImage> candidates;
    for (const ImageId id : parts_.near) {
      if (id != image.id) candidates.push_back({id, 0.0});
    }
    IngestOptions options = parts_.options;
    options.neighbors.extended_count_max = 0;
    VEDUTA_ASSIGN_OR_RETURN(
        const LocatedPhoto located,
        LocatePhoto(context, options, image, camera_, candidates, give_pose, seed));
    if (located.placement.verdict == Verdict::kPlaced &&
        located.placement.inlier_count >= options.mapper.sure_inlier_count) {
      NoteSearch(located);
      return true;
    }
    map_.Clear();
    return false;
  }

  // Refuses the pose where most of what it rests on may stand elsewhere.
  Status AskWhetherUnsure() {
    VEDUTA_ASSIGN_OR_RETURN(const auto unsure, Unsure());
    const auto may_stand_elsewhere = [&](const SupportAnswer& one) {
      const auto found = unsure->find(one.image);
      return found != unsure->end() &&
             std::ranges::binary_search(found->second, answer_.reconstruction);
    };
    const auto count =
        static_cast<size_t>(std::ranges::count_if(answer_.support, may_stand_elsewhere));
    return 2 * count > answer_.support.size()
               ? Refuse(Reason::kAmbiguous, "most photos that show the same may stand elsewhere")
               : Status::Ok();
  }

  Result<std::shared_ptr<const UnsureImages>> Unsure() const {
    if (parts_.unsure != nullptr) return parts_.unsure->Get(*parts_.snapshot);
    VEDUTA_ASSIGN_OR_RETURN(UnsureImages unsure, ListUnsure(*parts_.snapshot));
    return std::make_shared<const UnsureImages>(std::move(unsure));
  }

  void NoteSearch(const LocatedPhoto& located) {
    answer_.verdict = located.placement.verdict;
    answer_.reason = located.placement.reason;
    answer_.detail = located.placement.detail;
    answer_.inlier_count = located.placement.inlier_count;
    answer_.neighbor_count = static_cast<uint32_t>(located.search.pairs.size());
    answer_.pairs_tried = located.search.tried_count;
    for (const auto& [image, what] : located.search.damaged)
      answer_.damaged.push_back({image, what});
    answer_.times.match_ms = located.times.match_ms;
    answer_.times.verify_ms = located.times.verify_ms;
    answer_.times.map_ms = located.times.map_ms;
  }

  // Of an image that is placed in the map, the pose and what it rests on.
  Status Describe(ImageId id) {
    const MapImage& image = map_.image(id);
    answer_.reconstruction = image.reconstruction;
    answer_.cam_from_world = ToPlain(image.cam_from_world);
    VEDUTA_RETURN_IF_ERROR(loader_.LoadNeighborhood(CovisibleImages(map_, id, kNetworkImagesMax)));
    BundleProblem network = NetworkProblem(map_, id, kNetworkImagesMax);
    VEDUTA_ASSIGN_OR_RETURN(answer_.support, SupportOf(*parts_.snapshot, map_, id));
    if (lens_ == Lens::kEstimated && !answer_.stored.valid()) return DescribeWithLens(id, &network);
    if (const auto found = CovarianceInNetwork(network, BundleOptions().loss_scale_px))
      answer_.uncertainty = ToPlain(*found, map_.PointsSeenBy({&id, 1}).size(), 0);
    return Status::Ok();
  }

  // The pose with the camera that is refined with it, if what is seen determines them.
  Status DescribeWithLens(ImageId id, BundleProblem* network) {
    const std::optional<RefinedCamera> refined = RefineLens(id);
    if (!refined) return RefuseFocal("too little is seen to tell its focal length");
    network->cams_from_world[0] = refined->cam_from_world;
    network->cameras[0] = Pinhole(refined->camera);
    for (BundleObservation& seen : network->observations) {
      if (seen.image != 0) continue;
      const auto straight = UndistortPixel(refined->camera, DistortPixel(camera_, seen.x_px));
      if (!straight) return RefuseFocal("its lens distorts more than can be told");
      seen.x_px = *straight;
    }
    const auto found = CovarianceWithLens(*network, refined->camera, BundleOptions().loss_scale_px);
    const double deviation = found ? std::sqrt(found->lens(0, 0)) : 1;
    if (!(deviation <= kFocalDeviationShareMax)) {
      return RefuseFocal("its focal length may be off by " +
                         std::to_string(std::lround(100 * std::min(deviation, 10.0))) + " %");
    }
    answer_.cam_from_world = ToPlain(refined->cam_from_world);
    answer_.uncertainty = ToPlain(found->pose, map_.PointsSeenBy({&id, 1}).size(), 0);
    answer_.camera = EstimatedCamera{refined->camera, deviation, std::sqrt(found->lens(1, 1)),
                                     std::sqrt(found->lens(2, 2))};
    return Status::Ok();
  }

  // The pose and the lens by points that are put where two other images and more see them: those
  // that were adjusted to the photo repeat the lens that it had then. Nothing where too few are
  // left, or no camera comes out of them.
  std::optional<RefinedCamera> RefineLens(ImageId id) const {
    const MapImage& image = map_.image(id);
    std::vector<Eigen::Vector2d> x_px;
    std::vector<Eigen::Vector3d> points;
    for (size_t feature = 0; feature < image.points.size(); ++feature) {
      if (!image.points[feature].valid()) continue;
      PointRecord point = map_.point(image.points[feature]);
      std::erase_if(point.track, [id](const TrackElement& e) { return e.image == id; });
      if (point.track.size() < 2) continue;
      const std::optional<Eigen::Vector3d> position = Triangulate(map_.ViewsOf(point));
      if (!position) continue;
      const Keypoint& keypoint = image.features->keypoints[feature];
      x_px.push_back(DistortPixel(camera_, {keypoint.x_px, keypoint.y_px}));
      points.push_back(*position);
    }
    if (x_px.size() < UnknownCameraOptions().resection.inlier_count_min) return std::nullopt;
    const double scale_px = BundleOptions().loss_scale_px;
    RefinedCamera refined =
        RefineUnknownCamera(image.cam_from_world, camera_, x_px, points, scale_px);
    const double told = told_focal_px_ / refined.camera.fx;
    if (told >= 1 / kToldTimesMax && told <= kToldTimesMax) {
      refined = RefineUnknownCamera(refined.cam_from_world, refined.camera, x_px, points, scale_px,
                                    told_focal_px_);
    }
    if (!CheckCamera(refined.camera).ok() || !std::isfinite(refined.FocalDeviationShare()))
      return std::nullopt;
    return refined;
  }

  Status RefuseFocal(std::string why) { return Refuse(Reason::kUndetermined, std::move(why)); }

  Status Refuse(Reason reason, std::string why) {
    answer_.verdict = Verdict::kPostponed;
    answer_.reason = reason;
    answer_.detail = std::move(why);
    answer_.reconstruction = ReconstructionId();
    answer_.cam_from_world.reset();
    answer_.uncertainty.reset();
    answer_.camera.reset();
    answer_.support.clear();
    return Status::Ok();
  }

  const LocalizationParts& parts_;
  const CameraModel& camera_;
  const Lens lens_;
  const double told_focal_px_;  // 0: none is told
  CityMap map_;
  MapLoader loader_;
  LocalizedPhoto answer_;
};

}  // namespace

Result<LocalizedPhoto> LocalizePhoto(const LocalizationParts& parts, PreparedPhoto photo,
                                     const CameraModel& camera, Lens lens, double told_focal_px) {
  return CatchShortage("localise the photo", [&] {
    return Localization(parts, camera, lens, told_focal_px).Run(std::move(photo));
  });
}

}  // namespace veduta
