// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/model_founding.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

#include "engine/ingest/believed_pose.h"
#include "engine/ingest/local_unplacing.h"
#include "engine/ingest/map_loader.h"
#include "engine/ingest/merging.h"
#include "engine/ingest/placement_writer.h"
#include "engine/ingest/surroundings.h"
#include "engine/journal/journal.h"
#include "engine/mapping/neighbor_agreement.h"
#include "engine/query/forbidden.h"

namespace veduta {
namespace {

constexpr size_t kImagesMin = 3;  // of a reconstruction

// What verified matches say of an image's pose.
struct Votes {
  uint64_t agreeing = 0, contradicting = 0;
  double share() const {
    return static_cast<double>(contradicting) / static_cast<double>(agreeing + contradicting);
  }
};

// A verified pair of two of the photos.
struct VotingPair {
  ImageId a, b;
  uint64_t matches = 0;
  bool agrees = false;
};

class Founder final {
 public:
  Founder(const IngestParts& parts, const std::string& actor, WriteScope scope)
      : parts_(parts),
        actor_(actor),
        scope_(std::move(scope)),
        loader_(scope_.base, parts.features, &map_, parts.pool),
        context_{&loader_, &map_, parts.pool, parts.options.mapper} {}

  Result<ModelFounding> Run(std::span<const ModelPose> poses) {
    VEDUTA_ASSIGN_OR_RETURN(state_, scope_.base->GetState());
    placement_.verdict = Verdict::kPlaced;
    placement_.founded = placement_.reconstruction = ReconstructionId(state_.next_reconstruction);
    for (const ModelPose& pose : poses) VEDUTA_RETURN_IF_ERROR(Enter(pose));
    if (records_.empty()) return std::move(made_);
    VEDUTA_RETURN_IF_ERROR(RefuseContradicted());
    VEDUTA_RETURN_IF_ERROR(Grow());
    made_.placed = Images();
    if (made_.placed.size() < kImagesMin) {
      VEDUTA_RETURN_IF_ERROR(WriteRefused());
      made_.placed.clear();
    } else {
      VEDUTA_RETURN_IF_ERROR(WritePlaced());
      VEDUTA_RETURN_IF_ERROR(WriteRefused());
    }
    scope_.transaction->PutState(state_);
    VEDUTA_RETURN_IF_ERROR(scope_.transaction->Commit());
    parts_.map->Clear();  // it may hold what has merged
    return std::move(made_);
  }

 private:
  std::vector<ImageId> Images() const {
    std::vector<ImageId> images;
    for (const auto& [id, image] : map_.images()) {
      if (records_.contains(id) && image.reconstruction == placement_.founded) images.push_back(id);
    }
    return images;
  }

  // The image is in the map with its pose then, unless it is refused.
  Status Enter(const ModelPose& pose) {
    VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> known,
                            scope_.base->FindPose(pose.image));
    if (known) {
      made_.refused.push_back({pose.image, "it has a pose already, in reconstruction " +
                                               std::to_string(known->reconstruction.value)});
      return Status::Ok();
    }
    VEDUTA_ASSIGN_OR_RETURN(const bool is_forbidden, IsPoseForbidden(*scope_.base, pose.image));
    if (is_forbidden) {
      made_.refused.push_back({pose.image, "somebody has forbidden that it has a pose"});
      return Status::Ok();
    }
    VEDUTA_ASSIGN_OR_RETURN(records_[pose.image], scope_.base->GetImage(pose.image));
    VEDUTA_ASSIGN_OR_RETURN(const auto features, parts_.features->Get(*scope_.base, pose.image));
    MapImage image = UnplacedImage(*features);
    image.reconstruction = placement_.founded;
    image.cam_from_world = pose.cam_from_world;
    map_.PlaceImage(std::move(image));
    return Status::Ok();
  }

  // Those of the image with images of lower ids that are in the map.
  Result<std::vector<PairMatches>> PairsOf(ImageId id) const {
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors,
                            scope_.base->ListNeighbors(id));
    std::vector<PairMatches> pairs;
    for (const PairNeighbor& neighbor : neighbors) {
      if (neighbor.image > id || !map_.HasImage(neighbor.image)) continue;
      VEDUTA_ASSIGN_OR_RETURN(const PairRecord stored, loader_.GetPair(id, neighbor.image));
      pairs.push_back(MatchesFrom(stored, id));
    }
    return pairs;
  }

  Result<std::vector<VotingPair>> Vote() const {
    std::vector<VotingPair> votes;
    for (const ImageId id : Images()) {
      VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairMatches> pairs, PairsOf(id));
      for (const PairMatches& pair : pairs) {
        const NeighborAgreement found = CheckNeighbors(map_, placement_.founded, map_.image(id),
                                                       {&pair, 1}, parts_.options.mapper.agreement);
        if (found.agreeing_images + found.contradicting_images == 0) continue;
        votes.push_back({id, pair.other, pair.matches.size(), found.agreeing_images > 0});
      }
    }
    return votes;
  }

  void Refuse(ImageId id, Reason reason, std::string why) {
    map_.UnplaceImage(id);
    made_.refused.push_back({id, std::move(why), reason});
  }

  // One wrong pose makes right ones around it look wrong, too: the most contradicted goes first,
  // and then it has no vote any more.
  Status RefuseContradicted() {
    VEDUTA_ASSIGN_OR_RETURN(std::vector<VotingPair> votes, Vote());
    const double ratio_max = parts_.options.mapper.contradiction_share_max;
    for (;;) {
      std::map<ImageId, Votes> sums;
      for (const VotingPair& pair : votes) {
        for (const ImageId id : {pair.a, pair.b})
          (pair.agrees ? sums[id].agreeing : sums[id].contradicting) += pair.matches;
      }
      const auto worst =
          std::ranges::max_element(sums, {}, [](const auto& sum) { return sum.second.share(); });
      if (worst == sums.end() || static_cast<double>(worst->second.contradicting) <=
                                     ratio_max * static_cast<double>(worst->second.agreeing))
        return Status::Ok();
      const ImageId id = worst->first;
      std::erase_if(votes, [&](const VotingPair& pair) { return pair.a == id || pair.b == id; });
      Refuse(id, Reason::kContradictsNeighbors,
             "the model's pose contradicts " + std::to_string(worst->second.contradicting) +
                 " of " + std::to_string(worst->second.contradicting + worst->second.agreeing) +
                 " verified matches with photos of the model");
    }
  }

  // Poses and points together. The frame stays.
  Status Adjust() {
    const MapperOptions& options = parts_.options.mapper;
    const std::vector<ImageId> images = Images();
    const std::vector<PointId> points = map_.PointsSeenBy(images);
    if (points.empty()) return Status::Ok();
    VEDUTA_RETURN_IF_ERROR(
        AdjustBundle(&map_, images, points, options.global_bundle, parts_.pool).status());
    FilterPoints(&map_, points, options.filter);
    RefuseUnsupported();
    return Status::Ok();
  }

  // Points by the verified pairs and, as around each photo that is placed, by more matches once
  // these have settled the poses.
  Status Grow() {
    for (const ImageId id : Images()) {
      VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairMatches> pairs, PairsOf(id));
      GrowFromMatches(&map_, id, pairs, parts_.options.mapper.growth);
    }
    RefuseUnsupported();  // of which adjustment would make nothing
    VEDUTA_RETURN_IF_ERROR(Adjust());
    for (const ImageId id : Images()) VEDUTA_RETURN_IF_ERROR(GrowAround(context_, id));
    return Adjust();
  }

  void RefuseUnsupported() {
    for (bool changes = true; changes;) {
      changes = false;
      for (const ImageId id : Images()) {
        const uint32_t seen = CountObservations(map_.image(id));
        if (seen >= parts_.options.mapper.observations_min) continue;
        Refuse(id, Reason::kTooFewStructurePoints,
               "at the model's pose it sees only " + std::to_string(seen) + " points; " +
                   std::to_string(parts_.options.mapper.observations_min) + " are needed");
        changes = true;
      }
    }
  }

  // Merges with what its verified pairs lead to, and writes all of it.
  Status WritePlaced() {
    made_.point_count = map_.PointsSeenBy(made_.placed).size();
    std::map<ImageId, uint32_t> seen;
    for (const ImageId id : made_.placed) seen[id] = CountObservations(map_.image(id));
    placement_.placed = placement_.around = made_.placed;
    placement_.doubtful = made_.placed.front();  // all of it is to be judged
    const uint64_t seed = records_.at(made_.placed.front()).photo.Seed();
    VEDUTA_ASSIGN_OR_RETURN(MergeOutcome merged,
                            MergeAround(context_, {placement_.founded, true, made_.placed, {}},
                                        made_.placed, {}, seed));
    NoteMerges(std::move(merged), &placement_);
    placement_.verdict = Verdict::kPlaced;
    made_.reconstruction = placement_.reconstruction;
    AppendJournal({0,
                   0,
                   actor_,
                   "import",
                   {},
                   made_.reconstruction,
                   std::to_string(made_.placed.size()) + " photos with the poses of a model, by " +
                       std::to_string(made_.point_count) + " points" + placement_.detail},
                  &state_, scope_.transaction.get());
    for (const ImageId id : made_.placed) {
      ImageRecord& record = records_.at(id);
      record.verdict = Verdict::kPlaced;
      record.reason = Reason::kRegistered;
      record.detail = "by the pose of a model: sees " + std::to_string(seen.at(id)) + " points";
      scope_.transaction->PutImage(record);
      AppendJournal({0, 0, actor_, "import", id, made_.reconstruction, record.detail}, &state_,
                    scope_.transaction.get());
    }
    return WritePlacement(map_, *scope_.base, placement_, {}, &state_, scope_.transaction.get());
  }

  // Whoever has no pose of the model is tried again as others are.
  Status WriteRefused() {
    for (const ImageId id :
         made_.placed.size() < kImagesMin ? made_.placed : std::vector<ImageId>())
      made_.refused.push_back(
          {id, "no three photos have kept the poses of the model", Reason::kTooFewStructurePoints});
    for (const RefusedPose& refused : made_.refused) {
      if (refused.reason == Reason::kNone) continue;  // it stays as it is
      ImageRecord& record = records_.at(refused.image);
      record.verdict = Verdict::kPostponed;
      record.reason = refused.reason;
      record.detail = refused.why;
      scope_.transaction->PutImage(record);
      if (std::ranges::find(state_.pending_propagation, refused.image) ==
          state_.pending_propagation.end())
        state_.pending_propagation.push_back(refused.image);
    }
    return Status::Ok();
  }

  const IngestParts& parts_;
  const std::string& actor_;
  const WriteScope scope_;
  CityMap map_;
  MapLoader loader_;
  const MappingContext context_;
  DatabaseState state_;
  std::map<ImageId, ImageRecord> records_;  // of the photos that are entered
  Placement placement_;
  ModelFounding made_;
};

}  // namespace

Result<ModelFounding> FoundByModel(const IngestParts& parts, std::span<const ModelPose> poses,
                                   const std::string& actor, WriteScope scope) {
  return Founder(parts, actor, std::move(scope)).Run(poses);
}

}  // namespace veduta
