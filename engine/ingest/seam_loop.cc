// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/seam_loop.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "engine/ingest/seam.h"
#include "engine/mapping/uncertain_similarity.h"
#include "engine/query/unsure_poses.h"
#include "storage/base/angle.h"
#include "storage/base/median.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// Error at which what is seen across loses weight, px. As that of a seam's refinement.
constexpr double kErrorPx = 2.0;
// Seams of a detour: each leaves more open, and costs what a judgment of it costs. Chosen by hand;
// not measured.
constexpr size_t kDetourSeamsMax = 5;

// Verified pairs across two reconstructions that stand on one place: one witness.
struct Bridge {
  std::vector<SeamPair> pairs;
  std::set<ImageId> own, other;
  size_t match_count = 0;
};

Bridge BridgeOf(std::vector<SeamPair> pairs) {
  Bridge bridge;
  for (const SeamPair& pair : pairs) {
    bridge.own.insert(pair.a);
    bridge.other.insert(pair.matches.other);
    bridge.match_count += pair.matches.matches.size();
  }
  bridge.pairs = std::move(pairs);
  return bridge;
}

class LoopSearch {
 public:
  LoopSearch(const MappingContext& context, const OpenSeam& open)
      : context_(context), map_(*context.map), options_(context.options.loop), open_(open) {}

  Result<std::optional<ClosedLoop>> Find(std::span<const HypothesisRecord> detour) {
    VEDUTA_ASSIGN_OR_RETURN(
        seam_, FindSeam(context_.loader, map_, open_.near.front(), {}, open_.near, open_.other));
    if (open_.refuted_own_from_other) {
      seam_.pairs = PairsAgainst(map_, seam_, *open_.refuted_own_from_other, context_.options);
      // A weak pair may be one more that shows lookalike places.
      std::erase_if(seam_.pairs, [&](const SeamPair& pair) {
        return pair.matches.matches.size() < options_.matches_min;
      });
    }
    std::erase_if(seam_.pairs, [](const SeamPair& pair) {
      return pair.matches.geometry == PairGeometry::kRotation;
    });
    const std::vector<Bridge> bridges = ListBridges();
    if (bridges.size() > 1) {
      if (auto closed = CloseByBridges(bridges)) return closed;
    }
    if (detour.empty() || bridges.empty()) return std::optional<ClosedLoop>();
    return CloseByDetour(detour);
  }

 private:
  // Whether images of one reconstruction stand for one place: one of `some` and one of `others`.
  bool SeeOnePlace(const std::set<ImageId>& some, const std::set<ImageId>& others) {
    return std::ranges::any_of(some, [&](ImageId a) {
      return std::ranges::any_of(others, [&](ImageId b) { return a == b || SharePoints(a, b); });
    });
  }

  bool SharePoints(ImageId a, ImageId b) {
    const auto [it, is_new] = share_points_.try_emplace(std::minmax(a, b), false);
    if (!is_new) return it->second;
    const std::vector<PointId> of_a = map_.PointsSeenBy({&a, 1}), of_b = map_.PointsSeenBy({&b, 1});
    std::vector<PointId> shared;
    std::ranges::set_intersection(of_a, of_b, std::back_inserter(shared));
    it->second = shared.size() >= options_.shared_points_min;
    return it->second;
  }

  // The places where the two meet, those of most matches first.
  std::vector<Bridge> ListBridges() {
    std::vector<Bridge> bridges;
    for (const SeamPair& pair : seam_.pairs) {
      Bridge joined = BridgeOf({pair});
      for (auto it = bridges.begin(); it != bridges.end();) {
        if (!SeeOnePlace(it->own, joined.own) && !SeeOnePlace(it->other, joined.other)) {
          ++it;
          continue;
        }
        std::vector<SeamPair> pairs = std::move(it->pairs);
        pairs.insert(pairs.end(), joined.pairs.begin(), joined.pairs.end());
        joined = BridgeOf(std::move(pairs));
        it = bridges.erase(it);
      }
      bridges.push_back(std::move(joined));
    }
    std::ranges::stable_sort(bridges, std::greater<>(), &Bridge::match_count);
    return bridges;
  }

  std::optional<UncertainSimilarity> Measure(const SeamArea& seam, const Sim3& near_to) const {
    const CrossSightings seen = ListCrossSightings(map_, seam);
    UncertainSimilarity measured{RefineSeam(seen, near_to), {}};
    measured.covariance = CovarianceOf(measured.b_from_a, seen.in_into, seen.in_other, kErrorPx);
    const double deviation = measured.covariance.LogScaleDeviation();
    if (!(deviation <= options_.log_scale_deviation_max)) return std::nullopt;
    return measured;
  }

  std::optional<ClosedLoop> CloseByBridges(const std::vector<Bridge>& bridges) const {
    for (const Bridge& tested : bridges) {
      SeamArea rest;
      for (const Bridge& bridge : bridges) {
        if (&bridge != &tested)
          rest.pairs.insert(rest.pairs.end(), bridge.pairs.begin(), bridge.pairs.end());
      }
      const CrossSightings seen = ListCrossSightings(map_, rest);
      const auto start = AlignByViews(seen.in_into, seen.in_other, open_.own.value,
                                      LooseAlignment(context_.options));
      if (!start) continue;
      std::optional<UncertainSimilarity> known = Measure(rest, start->b_from_a);
      if (!known) continue;
      const std::set<ImageId> rest_own = BridgeOf(rest.pairs).own;
      known = Chain(BendAt(rest_own), *known);
      if (const auto closed = CloseAt(tested, *known)) {
        return ClosedLoop{{{open_.other, closed->own_from_other}},
                          {{open_.own, open_.other, ListOwn(bridges)}},
                          closed->Text("a second place where they meet")};
      }
    }
    return std::nullopt;
  }

  // Along the detour, own <- ... <- other, with what each part may be bent by.
  Result<std::optional<ClosedLoop>> CloseByDetour(std::span<const HypothesisRecord> detour) {
    const std::optional<ClosedLoop> none;
    const Bridge tested = BridgeOf(seam_.pairs);
    std::vector<UncertainSimilarity> links;
    std::vector<LoopPart> parts;  // on the way
    std::vector<LoopSeam> seams = {
        {open_.own, open_.other, {tested.own.begin(), tested.own.end()}}};
    ReconstructionId at = open_.own;
    std::set<ImageId> entered = tested.own;  // images of `at` at the seam before
    std::string through;
    for (const HypothesisRecord& hypothesis : detour) {
      const ReconstructionId next = hypothesis.a == at ? hypothesis.b : hypothesis.a;
      const Sim3 at_from_next =
          hypothesis.a == at ? hypothesis.a_from_b : hypothesis.a_from_b.Inverse();
      std::vector<ImageId> near;
      for (const ImageId image : hypothesis.images) {
        VEDUTA_RETURN_IF_ERROR(context_.loader->LoadImages({&image, 1}));
        if (map_.HasImage(image) && map_.image(image).reconstruction == at) near.push_back(image);
      }
      if (near.empty()) return none;
      VEDUTA_RETURN_IF_ERROR(context_.loader->LoadNeighborhood(near));
      VEDUTA_ASSIGN_OR_RETURN(const SeamArea seam,
                              FindSeam(context_.loader, map_, near.front(), {}, near, next));
      const Bridge bridge = BridgeOf(seam.pairs);
      if (bridge.pairs.empty() || SeeOnePlace(entered, bridge.own)) return none;
      const std::optional<UncertainSimilarity> measured = Measure(seam, at_from_next);
      if (!measured) return none;
      links.push_back(Chain(BendAt(bridge.own), *measured));
      seams.push_back({at, next, {bridge.own.begin(), bridge.own.end()}});
      at = next;
      entered = bridge.other;
      if (at == open_.other) break;
      parts.push_back({at, {}});
      through += (through.empty() ? "" : ", ") + std::to_string(at.value);
    }
    if (SeeOnePlace(entered, tested.other)) return none;
    links.back() = Chain(links.back(), BendAt(entered));
    UncertainSimilarity known = links.front();
    for (size_t i = 1; i < links.size(); ++i) known = Chain(known, links[i]);
    const auto closed = CloseAt(tested, known);
    if (!closed) return none;
    const std::vector<Sim3> frames = SpreadOver(links, closed->own_from_other);
    for (size_t i = 0; i < parts.size(); ++i) parts[i].own_from_part = frames[i];
    parts.insert(parts.begin(), {open_.other, closed->own_from_other});
    return std::optional(ClosedLoop{std::move(parts), std::move(seams),
                                    closed->Text("the way through reconstruction " + through)});
  }

  // What `tested` and the rest of a loop say together.
  struct Closing {
    Sim3 own_from_other;
    double distance = 0;
    SeamEvidence evidence;

    std::string Text(const std::string& by) const {
      char text[100];
      std::snprintf(text, sizeof(text), " agrees, to %.2g standard deviations", distance);
      return evidence.Text() + "; " + by + text;
    }
  };

  static std::vector<ImageId> ListOwn(const std::vector<Bridge>& bridges) {
    std::set<ImageId> own;
    for (const Bridge& bridge : bridges) own.insert(bridge.own.begin(), bridge.own.end());
    return {own.begin(), own.end()};
  }

  UncertainSimilarity BendAt(const std::set<ImageId>& images) const {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const ImageId id : images)
      mean += map_.image(id).cam_from_world.Center() / static_cast<double>(images.size());
    return Bend(mean, options_.bend_deg * kRadPerDeg, options_.bend_log_scale);
  }

  // Whether what is seen at `tested` agrees with what is known of the similarity without it.
  std::optional<Closing> CloseAt(const Bridge& tested, const UncertainSimilarity& known) const {
    const double vague = VaguenessAt(tested, known);
    const double vague_deg =
        std::sqrt(known.covariance.matrix.topLeftCorner<3, 3>().trace()) / kRadPerDeg;
    if (!(vague <= options_.position_share_max) || !(vague_deg <= options_.rotation_deg_max))
      return std::nullopt;
    SeamArea at;
    at.pairs = tested.pairs;
    const CrossSightings seen = ListCrossSightings(map_, at);
    const std::vector<CrossMatch> matches = ListMatches(tested);
    const auto closed = CloseChain(known, {seen.in_into, seen.in_other, matches});
    if (!closed || !(closed->distance <= options_.distance_max)) return std::nullopt;
    DoubtOptions doubt = context_.options.doubt;
    doubt.seam_pairs_min = 1;
    doubt.seam_jackknife_share_max = std::numeric_limits<double>::infinity();
    SeamEvidence evidence = JudgeSeam(map_, seam_, closed->b_from_a, context_.options);
    if (evidence.Refusal(doubt) || evidence.agreeing_matches < options_.matches_min)
      return std::nullopt;
    return Closing{closed->b_from_a, closed->distance, std::move(evidence)};
  }

  // How far the cameras of the other side may be off, over how far they see: the median.
  double VaguenessAt(const Bridge& tested, const UncertainSimilarity& known) const {
    std::vector<double> shares;
    for (const ImageId id : tested.other) {
      std::vector<double> depths;
      for (const SeenDepth& seen : ListSeenDepths(map_, map_.image(id)))
        depths.push_back(seen.depth);
      if (depths.empty()) continue;
      const Eigen::Vector3d center = known.b_from_a * map_.image(id).cam_from_world.Center();
      shares.push_back(known.covariance.PositionDeviation(center) /
                       (known.b_from_a.scale * MedianOf(std::move(depths))));
    }
    return shares.empty() ? std::numeric_limits<double>::infinity() : MedianOf(std::move(shares));
  }

  std::vector<CrossMatch> ListMatches(const Bridge& bridge) const {
    std::vector<CrossMatch> all;
    for (const SeamPair& pair : bridge.pairs) {
      const MapImage &own = map_.image(pair.a), &other = map_.image(pair.matches.other);
      for (const FeatureMatch& match : pair.matches.matches) {
        all.push_back({own.cam_from_world, own.camera.Normalize(own.features->keypoints[match.a]),
                       other.cam_from_world,
                       other.camera.Normalize(other.features->keypoints[match.b]),
                       std::min(own.camera.focal_px(), other.camera.focal_px())});
      }
    }
    return all;
  }

  const MappingContext& context_;
  const CityMap& map_;
  const LoopOptions& options_;
  const OpenSeam& open_;
  SeamArea seam_;
  std::map<std::pair<ImageId, ImageId>, bool> share_points_;  // of those that were asked
};

}  // namespace

Status LoopOptions::Check() const {
  return OptionBounds()
      .AtLeast("matches_min", matches_min, 1)
      .AtLeast("other_sightings_min", other_sightings_min, 1)
      .Above("log_scale_deviation_max", log_scale_deviation_max, 0)
      .AtLeast("bend_deg", bend_deg, 0)
      .AtLeast("bend_log_scale", bend_log_scale, 0)
      .AboveUpTo("position_share_max", position_share_max, 0, 1)
      .Inside("rotation_deg_max", rotation_deg_max, 0, 180)
      .Above("distance_max", distance_max, 0)
      .AtLeast("shared_points_min", shared_points_min, 1)
      .status();
}

ViewAlignmentOptions LooseAlignment(const MapperOptions& options) {
  ViewAlignmentOptions loose = options.view_alignment;
  loose.other_sightings_min = std::min(loose.other_sightings_min, options.loop.other_sightings_min);
  loose.log_scale_deviation_max =
      std::max(loose.log_scale_deviation_max, options.loop.log_scale_deviation_max);
  return loose;
}

bool MayCloseLoop(RefusalReason reason) {
  return reason == RefusalReason::kFewPairs || reason == RefusalReason::kUndetermined ||
         reason == RefusalReason::kOpen || reason == RefusalReason::kFarApart;
}

bool MayCloseLoop(const HypothesisRecord& hypothesis) {
  return MayCloseLoop(hypothesis.reason) ||
         (TellsPlacesApart(hypothesis.reason) && hypothesis.contradicting_pairs > 0);
}

Detours::Detours(std::span<const HypothesisRecord> all) {
  for (const HypothesisRecord& hypothesis : all) {
    if (!MayCloseLoop(hypothesis.reason) || hypothesis.reason == RefusalReason::kOpen) continue;
    steps_[hypothesis.a].push_back({hypothesis.b, &hypothesis});
    steps_[hypothesis.b].push_back({hypothesis.a, &hypothesis});
  }
  for (auto& [id, steps] : steps_) std::ranges::sort(steps, {}, &Step::to);
}

std::vector<HypothesisRecord> Detours::Find(ReconstructionId own, ReconstructionId other) const {
  struct Reached {
    size_t seams = 0;
    Step back{};  // to where it was reached from
  };
  std::map<ReconstructionId, Reached> reached = {{own, {}}};
  std::deque<ReconstructionId> next = {own};
  while (!next.empty() && !reached.contains(other)) {
    const ReconstructionId at = next.front();
    next.pop_front();
    const size_t seams = reached[at].seams + 1;
    const auto steps = steps_.find(at);
    if (seams > kDetourSeamsMax || steps == steps_.end()) continue;
    for (const Step& step : steps->second) {
      const bool is_their_own = at == own && step.to == other;
      if (!is_their_own && reached.try_emplace(step.to, Reached{seams, {at, step.by}}).second)
        next.push_back(step.to);
    }
  }
  std::vector<HypothesisRecord> way;
  if (!reached.contains(other)) return way;
  for (ReconstructionId at = other; at != own; at = reached[at].back.to)
    way.push_back(*reached[at].back.by);
  std::ranges::reverse(way);
  return way;
}

size_t CountLoopImages(const HypothesisRecord& hypothesis,
                       std::span<const HypothesisRecord> detour) {
  return std::accumulate(
      detour.begin(), detour.end(), hypothesis.images.size(),
      [](size_t sum, const HypothesisRecord& other) { return sum + other.images.size(); });
}

Result<std::optional<ClosedLoop>> CloseLoop(const MappingContext& context, const OpenSeam& open,
                                            std::span<const HypothesisRecord> detour) {
  return LoopSearch(context, open).Find(detour);
}

}  // namespace veduta
