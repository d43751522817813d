// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/agreeing_parts.h"

#include <algorithm>
#include <map>
#include <utility>

#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

struct Balance {
  uint64_t shared_points = 0, agreeing = 0, contradicting = 0;

  void Add(const Balance& other) {
    shared_points += other.shared_points;
    agreeing += other.agreeing;
    contradicting += other.contradicting;
  }
  bool Holds(const AgreementBounds& bounds) const {
    return shared_points >= bounds.shared_points_min &&
           static_cast<double>(contradicting) <=
               bounds.contradiction_share_max * static_cast<double>(agreeing);
  }
};

// The parts while they are being joined: each is known by one of its images.
class Parts {
 public:
  Parts(std::span<const ImageId> images, std::span<const PairEvidence> evidence,
        bool counts_turned) {
    for (const ImageId id : images) parts_[id] = {{id}, {}};
    for (const PairEvidence& e : evidence) {
      const uint32_t turned = counts_turned ? e.turned_matches : 0;
      const Balance balance{e.shared_points, e.agreeing_matches - turned,
                            e.contradicting_matches + turned};
      parts_.at(e.a).others[e.b].Add(balance);
      parts_.at(e.b).others[e.a].Add(balance);
    }
    for (const ImageId id : images) part_of_[id] = id;
  }

  // Joins the parts of the two images where the balance between them holds.
  bool TryJoin(ImageId a, ImageId b, const AgreementBounds& bounds) {
    ImageId into = part_of_.at(a), from = part_of_.at(b);
    if (into == from || !parts_.at(into).others[from].Holds(bounds)) return false;
    const auto size = [&](ImageId part) { return parts_.at(part).images.size(); };
    if (std::pair(size(into), from) < std::pair(size(from), into)) std::swap(into, from);
    Part moved = std::move(parts_.at(from));
    parts_.erase(from);
    Part& kept = parts_.at(into);
    for (const ImageId id : moved.images) part_of_[id] = into;
    kept.images.insert(kept.images.end(), moved.images.begin(), moved.images.end());
    kept.others.erase(from);
    for (const auto& [other, balance] : moved.others) {
      if (other == into) continue;
      kept.others[other].Add(balance);
      std::map<ImageId, Balance>& theirs = parts_.at(other).others;
      theirs.erase(from);
      theirs[into].Add(balance);
    }
    return true;
  }

  std::vector<std::vector<ImageId>> Take() {
    std::vector<std::vector<ImageId>> taken;
    for (auto& [id, part] : parts_) {
      std::sort(part.images.begin(), part.images.end());
      taken.push_back(std::move(part.images));
    }
    std::sort(taken.begin(), taken.end(), [](const auto& x, const auto& y) {
      return x.size() != y.size() ? x.size() > y.size() : x.front() < y.front();
    });
    return taken;
  }

 private:
  struct Part {
    std::vector<ImageId> images;
    std::map<ImageId, Balance> others;  // by the image that the other part is known by
  };
  std::map<ImageId, Part> parts_;
  std::map<ImageId, ImageId> part_of_;
};

}  // namespace

Status AgreementBounds::Check() const {
  return OptionBounds()
      .AtLeast("shared_points_min", shared_points_min, 1)
      .Above("contradiction_share_max", contradiction_share_max, 0)
      .status();
}

std::vector<std::vector<ImageId>> FindAgreeingParts(std::span<const ImageId> images,
                                                    std::span<const PairEvidence> evidence,
                                                    const AgreementBounds& bounds) {
  std::vector<PairEvidence> strongest(evidence.begin(), evidence.end());
  std::erase_if(strongest, [](const PairEvidence& e) { return e.shared_points == 0; });
  std::sort(strongest.begin(), strongest.end(), [](const PairEvidence& x, const PairEvidence& y) {
    return x.shared_points != y.shared_points ? x.shared_points > y.shared_points
                                              : std::pair(x.a, x.b) < std::pair(y.a, y.b);
  });
  Parts parts(images, evidence, bounds.counts_turned);
  // Where the evidence kept two parts apart, it may let the larger parts join that they are in now:
  // so it is tried again until nothing is joined any more.
  for (bool has_joined = true; has_joined;) {
    has_joined = false;
    for (const PairEvidence& e : strongest) has_joined |= parts.TryJoin(e.a, e.b, bounds);
  }
  return parts.Take();
}

}  // namespace veduta
