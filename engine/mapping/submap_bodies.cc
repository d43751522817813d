// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/submap_bodies.h"

#include <algorithm>
#include <optional>
#include <set>
#include <span>
#include <utility>

#include "engine/mapping/body_place.h"
#include "engine/mapping/single_linkage.h"
#include "engine/mapping/triangulation.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

// px. A view that is off by less agrees with where another submap sees the place: twice the scale
// of a relaxation's loss. Chosen by hand; not measured.
constexpr double kAgreeingPxMax = 4.0;
// Where a smaller share of a body's views across is far off, its place is not sought: what strain
// moved so far is left to the relaxation. Chosen by hand; not measured.
constexpr double kFarShareMin = 0.1;
// Bodies whose places are sought, those with most views across that are far off first: it takes 20
// ms for each. Chosen by hand.
constexpr size_t kBodiesMax = 16;

// A place that the views of one submap fix, as a camera of another sees it.
struct SubmapSighting {
  uint32_t of = 0, from = 0;  // the submap that fixes the place, and that of the camera
  bool agrees = false;        // where both stand now
  CrossSighting seen;
};

// The sightings of one tie, `views`.
void AppendSightings(std::span<const TieView> views, std::vector<SubmapSighting>* sightings) {
  std::set<uint32_t> submaps;
  for (const TieView& view : views) submaps.insert(view.submap);
  for (const uint32_t of : submaps) {
    std::vector<Sighting> own;
    for (const TieView& view : views)
      if (view.submap == of) own.push_back({view.cam_from_world, view.camera, view.x_px});
    const std::optional<Eigen::Vector3d> place = own.size() < 2 ? std::nullopt : Triangulate(own);
    if (!place) continue;
    for (const TieView& view : views) {
      if (view.submap == of) continue;
      const CrossSighting seen{view.image, view.cam_from_world, view.camera.Normalize(view.x_px),
                               *place, view.camera.focal_px()};
      const Eigen::Vector3d x = view.cam_from_world * *place;
      const bool agrees =
          x.z() > 0 && seen.focal_px * (x.hnormalized() - seen.x).norm() <= kAgreeingPxMax;
      sightings->push_back({of, view.submap, agrees, seen});
    }
  }
}

// Groups that hold together by the points that both of two submaps see, most points first.
std::vector<std::vector<uint32_t>> ListBodies(const RelaxationProblem& problem) {
  std::vector<SubmapPair> pairs = problem.pairs;
  std::ranges::stable_sort(pairs, std::ranges::greater(), &SubmapPair::shared_points);
  std::vector<Link> links;
  for (const SubmapPair& pair : pairs) links.push_back({pair.a, pair.b});
  return ListLinkedGroups(static_cast<uint32_t>(problem.centers.size()), links);
}

// What is seen across between submaps.
class Across {
 public:
  explicit Across(const RelaxationProblem& problem) : of_submap_(problem.centers.size()) {
    for (size_t tie = 0; tie + 1 < problem.first_view.size(); ++tie) {
      const uint32_t begin = problem.first_view[tie], end = problem.first_view[tie + 1];
      AppendSightings(std::span(problem.views).subspan(begin, end - begin), &sightings_);
    }
    for (uint32_t i = 0; i < sightings_.size(); ++i) {
      of_submap_[sightings_[i].of].push_back(i);
      of_submap_[sightings_[i].from].push_back(i);
    }
  }

  // How many views across the border of the body (ascending) are far off; 0 where that is a small
  // share of them.
  size_t CountFar(std::span<const uint32_t> body) const {
    size_t far = 0, all = 0;
    ForAcross(body, [&](const SubmapSighting& s, bool) { ++all, far += !s.agrees; });
    return static_cast<double>(far) < kFarShareMin * static_cast<double>(all) ? 0 : far;
  }

  // The place of the body where the submaps stand as `carried` says.
  std::optional<BodyPlace> FindPlace(std::span<const uint32_t> body,
                                     const std::vector<Sim3>& carried) const {
    std::vector<CrossSighting> in_rest, in_body;
    ForAcross(body, [&](const SubmapSighting& s, bool is_of_body) {
      CrossSighting& seen = (is_of_body ? in_rest : in_body).emplace_back(s.seen);
      seen.cam_from_world = TransformCameraWorld(carried[s.from], seen.cam_from_world);
      seen.point = carried[s.of] * seen.point;
    });
    return FindBodyPlace(in_rest, in_body, MixSeed(body.front(), body.size()));
  }

 private:
  // Calls visit(sighting, whether its place is one of the body's) for those across the border.
  void ForAcross(std::span<const uint32_t> body, const auto& visit) const {
    const auto holds = [&](uint32_t submap) { return std::ranges::binary_search(body, submap); };
    for (const uint32_t submap : body) {
      for (const uint32_t i : of_submap_[submap]) {
        const SubmapSighting& s = sightings_[i];
        if (holds(s.of) != holds(s.from)) visit(s, holds(s.of));
      }
    }
  }

  std::vector<SubmapSighting> sightings_;
  std::vector<std::vector<uint32_t>> of_submap_;  // [submap]: those of it or from it
};

}  // namespace

std::vector<Sim3> CarryBodies(const RelaxationProblem& problem, ThreadPool* pool) {
  const Across all(problem);
  const std::vector<std::vector<uint32_t>> bodies = ListBodies(problem);
  std::vector<std::pair<size_t, size_t>> far;  // how many views are, and the place in `bodies`
  for (size_t i = 0; i < bodies.size(); ++i)
    if (const size_t count = all.CountFar(bodies[i]); count > 0) far.emplace_back(count, i);
  std::ranges::stable_sort(far, std::ranges::greater(), &std::pair<size_t, size_t>::first);
  if (far.size() > kBodiesMax) far.resize(kBodiesMax);
  std::vector<Sim3> carried(problem.centers.size());
  std::vector<std::optional<BodyPlace>> found(far.size());
  pool->ParallelFor(far.size(),
                    [&](size_t i) { found[i] = all.FindPlace(bodies[far[i].second], carried); });
  std::vector<std::pair<double, size_t>> better;  // the share that it explains
  for (size_t i = 0; i < far.size(); ++i)
    if (found[i]) better.emplace_back(found[i]->share, far[i].second);
  std::ranges::stable_sort(better, std::ranges::greater(), &std::pair<double, size_t>::first);
  std::set<uint32_t> moved;
  for (const auto& [share, i] : better) {
    const std::vector<uint32_t>& body = bodies[i];
    if (std::ranges::any_of(body, [&](uint32_t submap) { return moved.contains(submap); }))
      continue;
    // Others may have moved since its place was found: seek it again.
    const std::optional<BodyPlace> place = all.FindPlace(body, carried);
    if (!place) continue;
    moved.insert(body.begin(), body.end());
    for (const uint32_t submap : body) carried[submap] = place->new_from_old * carried[submap];
  }
  if (moved.empty()) carried.clear();
  return carried;
}

}  // namespace veduta
