// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/hypotheses.h"

#include <algorithm>
#include <ctime>
#include <iterator>
#include <map>
#include <set>
#include <unordered_map>
#include <utility>

#include "engine/ingest/seam_loop.h"
#include "engine/journal/journal.h"
#include "engine/query/forbidden.h"
#include "engine/query/hypothesis_text.h"

namespace veduta {
namespace {

// After so many judgments by photos, a step looks for images on the wrong side of the seam. Chosen
// by hand; not measured.
constexpr uint32_t kJudgmentsBetween = 4;
// Images at a seam that a loop may close: twelve for each side of two places. A judgment reads all
// of them. Chosen by hand; not measured.
constexpr size_t kLoopImagesMax = 48;
constexpr size_t kImagesOfTwoPlaces = 4;  // a pair each

using Two = std::pair<ReconstructionId, ReconstructionId>;  // ascending

bool IsOf(const HypothesisRecord& hypothesis, ReconstructionId reconstruction) {
  return hypothesis.a == reconstruction || hypothesis.b == reconstruction;
}

ReconstructionId OtherOf(const HypothesisRecord& hypothesis, ReconstructionId reconstruction) {
  return hypothesis.a == reconstruction ? hypothesis.b : hypothesis.a;
}

void JournalNew(const HypothesisRecord& hypothesis, DatabaseState* state,
                Transaction* transaction) {
  AppendJournal({0, 0, "veduta", "hypothesis", hypothesis.image, hypothesis.a,
                 "merge with reconstruction " + std::to_string(hypothesis.b.value) + ": " +
                     RefusalText(hypothesis)},
                state, transaction);
}

// The stored hypotheses, what one placement makes of them, and which of them that has changed.
class Ledger final {
 public:
  Ledger(const Snapshot& base, const Placement& placement) : base_(base), placement_(placement) {}

  Status Load() {
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<HypothesisRecord> stored, base_.ListHypotheses());
    for (const HypothesisRecord& hypothesis : stored)
      known_[{hypothesis.a, hypothesis.b}] = hypothesis;
    return Status::Ok();
  }

  // Deletes hypotheses whose merge was made, and moves those of a reconstruction that was merged
  // away to the one that took it in.
  Status TakeMerges() {
    for (const Merge& merge : placement_.merges) {
      CarryOver(merge);
      VEDUTA_RETURN_IF_ERROR(TakePairsOf(merge.from));
    }
    return Status::Ok();
  }

  void TakeRefused(DatabaseState* state, Transaction* transaction) {
    for (const HypothesisRecord& refused : placement_.refused) {
      const auto [it, is_new] = known_.try_emplace({refused.a, refused.b}, refused);
      HypothesisRecord& hypothesis = it->second;
      if (is_new) {
        JournalNew(hypothesis, state, transaction);
      } else {
        const HypothesisRecord before = TakeVotes(refused, &hypothesis);
        hypothesis.judgment_count = before.judgment_count + 1;
        hypothesis.loop_images = before.loop_images;
        if (before.image.valid()) hypothesis.image = before.image;
        // The search of a photo weighs the sides for a few images only.
        if (!placement_.placed.empty()) AddUnsure(before.unsure, &hypothesis);
      }
      // One of the two has changed since; or an image may stand on the wrong side of the seam.
      const bool is_sought = is_new || (!placement_.placed.empty() &&
                                        hypothesis.judgment_count % kJudgmentsBetween == 0);
      hypothesis.is_due = !placement_.merges.empty() || (is_sought && hypothesis.missing_cells > 0);
      hypothesis.time_unix_s = std::time(nullptr);
      changed_.insert(it->first);
      judged_.insert(it->first);
    }
  }

  // To those that the photo's search has not judged, nothing happens unless they have grown.
  void TakeKnown() {
    for (const KnownSeam& seam : placement_.known) {
      const Two two = std::minmax(seam.own, seam.other);
      const auto found = known_.find(two);
      if (found == known_.end()) continue;
      if (seam.has_grown) MakeDue(&found->second);
      if (!seam.unsure.empty()) TakeUnsure(seam.unsure, &found->second);
      judged_.insert(two);
    }
  }

  // A photo that is tied most strongly to an image that is not sure of its side is not sure either.
  void TakeStrongest() {
    if (!placement_.strongest.valid()) return;
    for (auto& [two, hypothesis] : known_) {
      if (IsOf(hypothesis, placement_.reconstruction) &&
          std::ranges::binary_search(hypothesis.unsure, placement_.strongest))
        TakeUnsure({placement_.placed.front()}, &hypothesis);
    }
  }

  // Those that a loop may confirm, where many more images have come to speak for it, or a merge has
  // made it shorter.
  void TakeLoops() {
    if (changed_.empty()) return;
    std::vector<HypothesisRecord> all;
    for (const auto& [two, hypothesis] : known_) all.push_back(hypothesis);
    const Detours detours(all);
    for (auto& [two, hypothesis] : known_) {
      if (!MayCloseLoop(hypothesis) || hypothesis.is_due) continue;
      const std::vector<HypothesisRecord> detour = detours.Find(hypothesis.a, hypothesis.b);
      // Two places where the two meet make a loop, too.
      if (detour.empty() && hypothesis.images.size() < kImagesOfTwoPlaces) continue;
      const auto images = static_cast<uint32_t>(CountLoopImages(hypothesis, detour));
      if (placement_.placed.empty() && judged_.contains(two)) {  // with this loop, just now
        hypothesis.loop_images = images;
        continue;
      }
      if (IsAnotherWay(detour)) hypothesis.loop_images = 0;
      if (4 * images >= 5 * hypothesis.loop_images + 1) MakeDue(&hypothesis);
    }
  }

  // Whether the detour leads over a reconstruction that another one was merged into just now.
  bool IsAnotherWay(std::span<const HypothesisRecord> detour) const {
    return !placement_.merges.empty() &&
           std::ranges::any_of(detour, [&](const HypothesisRecord& seam) {
             return IsOf(seam, placement_.reconstruction);
           });
  }

  void TakeTouched() {
    const std::set<ImageId> around(placement_.around.begin(), placement_.around.end());
    for (auto& [two, hypothesis] : known_) {
      // Photos that lost their poses by the split come back at once, and are no new evidence.
      // And one that is open says nothing by itself.
      if (hypothesis.reason == RefusalReason::kSplit || hypothesis.reason == RefusalReason::kOpen)
        continue;
      const bool is_touched = IsOf(hypothesis, placement_.reconstruction) &&
                              std::ranges::any_of(hypothesis.images, [&](ImageId image) {
                                return around.contains(image);
                              });
      if (is_touched && !judged_.contains(two)) MakeDue(&hypothesis);
    }
  }

  // Deletes hypotheses of forbidden merges: what is forbidden of a reconstruction that was merged
  // away is forbidden of the one that took it in, too.
  Status DropForbidden() {
    if (placement_.merges.empty()) return Status::Ok();
    for (auto it = known_.begin(); it != known_.end();) {
      bool is_forbidden = false;
      if (IsOf(it->second, placement_.reconstruction)) {
        const ReconstructionId other = OtherOf(it->second, placement_.reconstruction);
        VEDUTA_ASSIGN_OR_RETURN(is_forbidden, IsForbidden(other));
      }
      if (is_forbidden) gone_.insert(it->first);
      it = is_forbidden ? known_.erase(it) : std::next(it);
    }
    return Status::Ok();
  }

  void Write(Transaction* transaction) const {
    for (const auto& [a, b] : gone_) {
      if (!known_.contains({a, b})) transaction->DeleteHypothesis(a, b);
    }
    for (const Two& two : changed_) {
      if (const auto found = known_.find(two); found != known_.end())
        transaction->PutHypothesis(found->second);
    }
  }

 private:
  void TakeUnsure(const std::vector<ImageId>& unsure, HypothesisRecord* hypothesis) {
    std::vector<ImageId> images;
    std::ranges::set_union(hypothesis->images, unsure, std::back_inserter(images));
    hypothesis->images = std::move(images);
    AddUnsure(unsure, hypothesis);
    changed_.insert({hypothesis->a, hypothesis->b});
  }

  // Those of the images that are at the seam.
  static void AddUnsure(const std::vector<ImageId>& images, HypothesisRecord* hypothesis) {
    std::vector<ImageId> at_seam, unsure;
    std::ranges::set_intersection(images, hypothesis->images, std::back_inserter(at_seam));
    std::ranges::set_union(hypothesis->unsure, at_seam, std::back_inserter(unsure));
    hypothesis->unsure = std::move(unsure);
  }

  // The votes of a new judgment, but not where they only say that nothing follows from the pairs.
  // Where a loop may close, images stay at the seam that this judgment has not come across. Returns
  // the hypothesis as it was.
  static HypothesisRecord TakeVotes(const HypothesisRecord& refused, HypothesisRecord* hypothesis) {
    HypothesisRecord before = *hypothesis;
    const bool says_less =
        refused.reason == RefusalReason::kOpen && hypothesis->reason != RefusalReason::kOpen;
    if (!says_less) *hypothesis = refused;
    if (MayCloseLoop(*hypothesis)) {
      std::vector<ImageId> images;
      std::ranges::set_union(before.images, refused.images, std::back_inserter(images));
      if (images.size() <= kLoopImagesMax) hypothesis->images = std::move(images);
    }
    return before;
  }

  void MakeDue(HypothesisRecord* hypothesis) {
    if (hypothesis->is_due) return;
    hypothesis->is_due = true;
    changed_.insert({hypothesis->a, hypothesis->b});
  }

  void CarryOver(const Merge& merge) {
    const ReconstructionId into = placement_.reconstruction;
    std::vector<HypothesisRecord> carried;
    for (auto it = known_.begin(); it != known_.end();) {
      if (!IsOf(it->second, merge.from)) {
        ++it;
        continue;
      }
      if (OtherOf(it->second, merge.from) != into) carried.push_back(it->second);
      gone_.insert(it->first);
      it = known_.erase(it);
    }
    for (HypothesisRecord& hypothesis : carried) {
      GoOver(merge, into, &hypothesis);
      const Two two(hypothesis.a, hypothesis.b);
      const auto [it, is_new] = known_.try_emplace(two, hypothesis);
      HypothesisRecord& kept = it->second;
      if (!is_new) Join(std::move(hypothesis), &kept);
      kept.is_due = true;
      changed_.insert(two);
    }
  }

  // The photos that came by a merge may speak for or against what is known of the whole and of
  // those that they have verified pairs with. Of others they say nothing.
  Status TakePairsOf(ReconstructionId merged) {
    const ReconstructionId into = placement_.reconstruction;
    const bool is_waiting = std::ranges::any_of(known_, [&](const auto& known) {
      return IsOf(known.second, into) && !known.second.is_due;
    });
    if (!is_waiting) return Status::Ok();
    VEDUTA_ASSIGN_OR_RETURN(const std::set<ReconstructionId> paired, ListPaired(merged));
    for (auto& [two, hypothesis] : known_) {
      if (IsOf(hypothesis, into) && paired.contains(OtherOf(hypothesis, into)))
        MakeDue(&hypothesis);
    }
    return Status::Ok();
  }

  // The reconstructions that photos of this one have verified pairs with. Scans all poses.
  Result<std::set<ReconstructionId>> ListPaired(ReconstructionId of) const {
    std::vector<ImageId> members;
    std::unordered_map<ImageId, ReconstructionId> homes;
    VEDUTA_RETURN_IF_ERROR(base_.ScanPoses([&](const PoseRecord& pose) {
      homes[pose.image] = pose.reconstruction;
      if (pose.reconstruction == of) members.push_back(pose.image);
      return true;
    }));
    std::set<ReconstructionId> paired;
    for (const ImageId member : members) {
      VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors,
                              base_.ListNeighbors(member));
      for (const PairNeighbor& neighbor : neighbors) {
        if (const auto home = homes.find(neighbor.image); home != homes.end())
          paired.insert(home->second);
      }
    }
    return paired;
  }

  // Two seams that have become one: the one that says more is kept, with the images of both.
  static void Join(HypothesisRecord carried, HypothesisRecord* kept) {
    if (kept->reason == RefusalReason::kOpen) std::swap(carried, *kept);
    std::vector<ImageId> images;
    std::ranges::set_union(kept->images, carried.images, std::back_inserter(images));
    kept->images = std::move(images);
    AddUnsure(carried.unsure, kept);
    kept->loop_images = 0;
  }

  Result<bool> IsForbidden(ReconstructionId other) const {
    std::set<ReconstructionId> joined = {placement_.reconstruction};
    for (const Merge& merge : placement_.merges) joined.insert(merge.from);
    for (const ReconstructionId id : joined) {
      VEDUTA_ASSIGN_OR_RETURN(const bool forbidden, IsMergeForbidden(base_, id, other));
      if (forbidden) return true;
    }
    return false;
  }

  const Snapshot& base_;
  const Placement& placement_;
  std::map<Two, HypothesisRecord> known_;
  std::set<Two> gone_, changed_, judged_;
};

}  // namespace

void GoOver(const Merge& merge, ReconstructionId into, HypothesisRecord* hypothesis) {
  if (!IsOf(*hypothesis, merge.from)) return;
  if (hypothesis->a == merge.from) {
    hypothesis->a = into;
    hypothesis->a_from_b = merge.into_from * hypothesis->a_from_b;
  } else {
    hypothesis->b = into;
    hypothesis->a_from_b = hypothesis->a_from_b * merge.into_from.Inverse();
  }
  if (hypothesis->reason == RefusalReason::kOpen) hypothesis->a_from_b = {};
  if (hypothesis->a < hypothesis->b) return;
  std::swap(hypothesis->a, hypothesis->b);
  hypothesis->a_from_b = hypothesis->a_from_b.Inverse();
}

Status WriteHypotheses(const Snapshot& base, const Placement& placement, DatabaseState* state,
                       Transaction* transaction) {
  Ledger ledger(base, placement);
  VEDUTA_RETURN_IF_ERROR(ledger.Load());
  VEDUTA_RETURN_IF_ERROR(ledger.TakeMerges());
  ledger.TakeRefused(state, transaction);
  ledger.TakeKnown();
  ledger.TakeStrongest();
  ledger.TakeTouched();
  ledger.TakeLoops();
  VEDUTA_RETURN_IF_ERROR(ledger.DropForbidden());
  ledger.Write(transaction);
  return Status::Ok();
}

void PutNewHypothesis(HypothesisRecord hypothesis, DatabaseState* state, Transaction* transaction) {
  hypothesis.time_unix_s = std::time(nullptr);
  JournalNew(hypothesis, state, transaction);
  transaction->PutHypothesis(hypothesis);
}

Status MakeHypothesesDue(const Snapshot& base, ReconstructionId reconstruction,
                         std::span<const ImageId> images, Splits splits, Transaction* transaction) {
  VEDUTA_ASSIGN_OR_RETURN(std::vector<HypothesisRecord> all, base.ListHypotheses());
  for (HypothesisRecord& hypothesis : all) {
    if (!IsOf(hypothesis, reconstruction) || hypothesis.is_due) continue;
    if (splits == Splits::kPassedOver && hypothesis.reason == RefusalReason::kSplit) continue;
    if (hypothesis.reason == RefusalReason::kOpen && hypothesis.loop_images == 0) continue;
    const bool is_meant = images.empty() || std::ranges::any_of(hypothesis.images, [&](ImageId id) {
                            return std::ranges::binary_search(images, id);
                          });
    if (!is_meant) continue;
    hypothesis.is_due = true;
    transaction->PutHypothesis(hypothesis);
  }
  return Status::Ok();
}

Status MakeHypothesisDue(const Snapshot& base, ReconstructionId a, ReconstructionId b,
                         Transaction* transaction) {
  VEDUTA_ASSIGN_OR_RETURN(std::vector<HypothesisRecord> all, base.ListHypotheses());
  for (HypothesisRecord& hypothesis : all) {
    if (!IsOf(hypothesis, a) || !IsOf(hypothesis, b) || hypothesis.is_due) continue;
    hypothesis.is_due = true;
    transaction->PutHypothesis(hypothesis);
  }
  return Status::Ok();
}

Status DropHypotheses(const Snapshot& base, ReconstructionId reconstruction,
                      Transaction* transaction) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<HypothesisRecord> all, base.ListHypotheses());
  for (const HypothesisRecord& hypothesis : all) {
    if (IsOf(hypothesis, reconstruction)) transaction->DeleteHypothesis(hypothesis.a, hypothesis.b);
  }
  return Status::Ok();
}

Status ForgetInHypotheses(const Snapshot& base, ImageId image, Transaction* transaction) {
  VEDUTA_ASSIGN_OR_RETURN(std::vector<HypothesisRecord> all, base.ListHypotheses());
  for (HypothesisRecord& hypothesis : all) {
    const bool proposed_it = hypothesis.image == image;
    const bool is_at_seam = std::erase(hypothesis.images, image) > 0;
    std::erase(hypothesis.unsure, image);
    if (!proposed_it && !is_at_seam) continue;
    if (proposed_it) hypothesis.image = {};
    if (hypothesis.images.empty()) {
      transaction->DeleteHypothesis(hypothesis.a, hypothesis.b);
      continue;
    }
    hypothesis.is_due = hypothesis.is_due || is_at_seam;
    transaction->PutHypothesis(hypothesis);
  }
  return Status::Ok();
}

}  // namespace veduta
