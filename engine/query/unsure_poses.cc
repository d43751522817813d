// SPDX-License-Identifier: Apache-2.0
#include "engine/query/unsure_poses.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <set>

#include "storage/base/content_feed.h"

namespace veduta {
namespace {

// The numbers below were chosen on four streets with twin facades (--seed 803, 804, 807, 808).
//
// Points that two images share, at least, for one to hold the other in its place. From 30 to 100
// the same images were told.
constexpr size_t kHoldingPointsMin = 50;
// Matches of a verified pair that speaks against a place, at least, and how strong it must be over
// the strongest pair with a sure image that agrees: of castle-P19's pairs some show lookalike
// facades, and the others are far stronger.
constexpr uint32_t kSpeakingMatchesMin = 100;
constexpr double kSpeakingShareMin = 0.6;
// A pair agrees with where its images stand if so many of its matches are points that both see.
constexpr double kAgreeingShareMin = 0.1;

// A reconstruction at a seam of two places that look alike.
struct Part {
  std::set<ReconstructionId> others;               // on the other sides
  std::map<ImageId, std::vector<PointId>> points;  // that each of its images sees, ascending
};
using Parts = std::map<ReconstructionId, Part>;

size_t CountShared(const std::vector<PointId>& a, const std::vector<PointId>& b) {
  std::vector<PointId> shared;
  std::ranges::set_intersection(a, b, std::back_inserter(shared));
  return shared.size();
}

// Images that hold each other, as a forest.
class Bodies {
 public:
  void Add(ImageId image) { parent_[image] = image; }
  ImageId RootOf(ImageId image) {
    while (parent_.at(image) != image) image = parent_.at(image) = parent_.at(parent_.at(image));
    return image;
  }
  void Join(ImageId a, ImageId b) {
    const ImageId root_a = RootOf(a), root_b = RootOf(b);
    parent_[std::max(root_a, root_b)] = std::min(root_a, root_b);
  }
  // The root of the body of most images, of those the lowest.
  ImageId Largest() {
    std::map<ImageId, size_t> sizes;
    for (const auto& [image, parent] : parent_) ++sizes[RootOf(image)];
    const auto size = [](const auto& body) { return body.second; };
    return sizes.empty() ? ImageId() : std::ranges::max_element(sizes, {}, size)->first;
  }

 private:
  std::map<ImageId, ImageId> parent_;
};

// One reconstruction, with the verified pairs between its images.
class PartJudge {
 public:
  explicit PartJudge(const Part& part) : part_(part) {}

  Status LoadPairs(const Snapshot& snapshot) {
    for (const auto& [image, points] : part_.points) {
      VEDUTA_ASSIGN_OR_RETURN(std::vector<PairNeighbor> neighbors, snapshot.ListNeighbors(image));
      for (const PairNeighbor& neighbor : neighbors) {
        if (!part_.points.contains(neighbor.image)) continue;
        const size_t shared = CountShared(points, part_.points.at(neighbor.image));
        pairs_[image].push_back({neighbor.image, neighbor.match_count, shared});
      }
    }
    return Status::Ok();
  }

  // Images where a strong pair says that they stand elsewhere.
  std::vector<ImageId> SpokenAgainst(const UnsureImages& unsure) const {
    std::vector<ImageId> images;
    for (const auto& [image, pairs] : pairs_) {
      uint32_t agreeing = 0, speaking = 0;  // matches of the strongest pair of either kind
      for (const Pair& pair : pairs) {
        const bool agrees = static_cast<double>(pair.shared) >= kAgreeingShareMin * pair.matches;
        if (!agrees) speaking = std::max(speaking, pair.matches);
        if (agrees && !unsure.contains(pair.other)) agreeing = std::max(agreeing, pair.matches);
      }
      if (speaking >= kSpeakingMatchesMin && speaking >= kSpeakingShareMin * agreeing)
        images.push_back(image);
    }
    return images;
  }

  // Images that only unsure ones tie to the rest.
  std::vector<ImageId> CutOff(const UnsureImages& unsure) const {
    Bodies bodies;
    for (const auto& [image, points] : part_.points) {
      if (!unsure.contains(image)) bodies.Add(image);
    }
    for (const auto& [image, pairs] : pairs_) {
      for (const Pair& pair : pairs) {
        if (pair.shared >= kHoldingPointsMin && !unsure.contains(image) &&
            !unsure.contains(pair.other))
          bodies.Join(image, pair.other);
      }
    }
    std::vector<ImageId> images;
    const ImageId largest = bodies.Largest();
    for (const auto& [image, points] : part_.points) {
      if (!unsure.contains(image) && bodies.RootOf(image) != largest) images.push_back(image);
    }
    return images;
  }

 private:
  struct Pair {
    ImageId other;
    uint32_t matches = 0;
    size_t shared = 0;  // points
  };
  const Part& part_;
  std::map<ImageId, std::vector<Pair>> pairs_;
};

Status LoadPoints(const Snapshot& snapshot, Parts* parts) {
  std::vector<PoseRecord> poses;
  VEDUTA_RETURN_IF_ERROR(snapshot.ScanPoses([&](const PoseRecord& pose) {
    if (parts->contains(pose.reconstruction)) poses.push_back(pose);
    return true;
  }));
  for (const PoseRecord& pose : poses) {
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<Observation> seen,
                            snapshot.GetObservations(pose.image));
    std::vector<PointId>& points = (*parts)[pose.reconstruction].points[pose.image];
    for (const Observation& one : seen) points.push_back(one.point);
    std::ranges::sort(points);
  }
  return Status::Ok();
}

Result<UnsureImages> FindUnsure(const Snapshot& snapshot,
                                const std::vector<HypothesisRecord>& all) {
  UnsureImages unsure;
  Parts parts;
  for (const HypothesisRecord& hypothesis : all) {
    for (const ImageId image : hypothesis.unsure) {
      VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, snapshot.FindPose(image));
      // It may have lost its pose since, or have got one in a third reconstruction.
      if (!pose) continue;
      if (pose->reconstruction == hypothesis.a) unsure[image].push_back(hypothesis.b);
      if (pose->reconstruction == hypothesis.b) unsure[image].push_back(hypothesis.a);
    }
    if (!TellsPlacesApart(hypothesis.reason)) continue;
    parts[hypothesis.a].others.insert(hypothesis.b);
    parts[hypothesis.b].others.insert(hypothesis.a);
  }
  for (auto& [image, others] : unsure) std::ranges::sort(others);
  if (parts.empty()) return unsure;
  VEDUTA_RETURN_IF_ERROR(LoadPoints(snapshot, &parts));
  for (const auto& [id, part] : parts) {
    const auto add = [&, &others = part.others](const std::vector<ImageId>& images) {
      for (const ImageId image : images) {
        std::vector<ReconstructionId>& elsewhere = unsure[image];
        if (elsewhere.empty()) elsewhere.assign(others.begin(), others.end());
      }
    };
    PartJudge judge(part);
    VEDUTA_RETURN_IF_ERROR(judge.LoadPairs(snapshot));
    add(judge.SpokenAgainst(unsure));
    add(judge.CutOff(unsure));
  }
  return unsure;
}

// What the answer rests on, shorter than it. Whatever changes poses or what is seen writes into the
// journal; the judgment of a merge need not.
Result<std::string> KeyOf(const Snapshot& snapshot, const std::vector<HypothesisRecord>& all) {
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, snapshot.GetState());
  ContentFeed feed;
  feed << state.next_journal;
  for (const HypothesisRecord& hypothesis : all) {
    feed << hypothesis.a << hypothesis.b << hypothesis.reason
         << static_cast<uint64_t>(hypothesis.unsure.size());
    for (const ImageId image : hypothesis.unsure) feed << image;
  }
  return feed.Finish().Hex();
}

}  // namespace

bool TellsPlacesApart(RefusalReason reason) {
  return reason == RefusalReason::kMissingStructure || reason == RefusalReason::kContradicted;
}

Result<UnsureImages> ListUnsure(const Snapshot& snapshot) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<HypothesisRecord> all, snapshot.ListHypotheses());
  return FindUnsure(snapshot, all);
}

Result<std::shared_ptr<const UnsureImages>> UnsureCache::Get(const Snapshot& snapshot) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<HypothesisRecord> all, snapshot.ListHypotheses());
  VEDUTA_ASSIGN_OR_RETURN(std::string key, KeyOf(snapshot, all));
  {
    const std::lock_guard lock(mutex_);
    if (answer_ != nullptr && key == key_) return answer_;
  }
  VEDUTA_ASSIGN_OR_RETURN(UnsureImages unsure, FindUnsure(snapshot, all));
  auto answer = std::make_shared<const UnsureImages>(std::move(unsure));
  const std::lock_guard lock(mutex_);
  key_ = std::move(key);
  return answer_ = std::move(answer);
}

}  // namespace veduta
