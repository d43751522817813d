// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/calibration/observation_choice.h"

#include <algorithm>
#include <set>

#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

uint32_t NewNumber(const std::vector<uint32_t>& kept, uint32_t old) {
  return static_cast<uint32_t>(std::lower_bound(kept.begin(), kept.end(), old) - kept.begin());
}

}  // namespace

Status ChoiceOptions::Check() const {
  return OptionBounds()
      .AtLeast("photo_points_min", photo_points_min, 4)
      .AboveUpTo("photo_share_min", photo_share_min, 0, 1)
      .status();
}

void ChooseObservations(const std::vector<PlaneObservation>& observations,
                        const std::vector<double>& errors, const ChoiceOptions& options,
                        ObservationChoice* choice) {
  const Status status = options.Check();
  VEDUTA_CHECK(status.ok(), status.message());
  std::vector<uint32_t> seen(choice->why_left_out.size()), fitting(seen);
  for (size_t i = 0; i < observations.size(); ++i) {
    ++seen[observations[i].view];
    fitting[observations[i].view] += errors[i] <= 1;
  }
  for (size_t v = 0; v < seen.size(); ++v) {
    std::string& why = choice->why_left_out[v];
    if (!why.empty()) continue;
    const std::string counts =
        std::to_string(fitting[v]) + " of its " + std::to_string(seen[v]) + " points fit";
    if (static_cast<double>(fitting[v]) < options.photo_share_min * static_cast<double>(seen[v])) {
      why = "only " + counts + " with the other photos";
    } else if (fitting[v] < options.photo_points_min) {
      why = "too few points: " + counts + ", " + std::to_string(options.photo_points_min) +
            " are needed";
    }
  }
  choice->is_used.assign(observations.size(), false);
  uint32_t point_count = 0;
  for (const PlaneObservation& o : observations) point_count = std::max(point_count, o.point + 1);
  std::vector<uint32_t> sightings(point_count);
  for (size_t i = 0; i < observations.size(); ++i) {
    choice->is_used[i] = errors[i] <= 1 && choice->why_left_out[observations[i].view].empty();
    sightings[observations[i].point] += choice->is_used[i];
  }
  for (size_t i = 0; i < observations.size(); ++i) {  // one sighting says nothing
    if (sightings[observations[i].point] < 2) choice->is_used[i] = false;
  }
}

CompactScene Compact(const std::vector<PlaneObservation>& observations,
                     const ObservationChoice& choice, const PlaneScene& whole) {
  CompactScene compact;
  std::set<uint32_t> views, points;
  for (size_t i = 0; i < observations.size(); ++i) {
    if (!choice.is_used[i]) continue;
    views.insert(observations[i].view);
    points.insert(observations[i].point);
    compact.indices.push_back(static_cast<uint32_t>(i));
  }
  compact.views.assign(views.begin(), views.end());
  compact.points.assign(points.begin(), points.end());
  compact.scene.camera() = whole.camera();
  for (const uint32_t v : compact.views)
    compact.scene.cams_from_world.push_back(whole.cams_from_world[v]);
  for (const uint32_t p : compact.points) compact.scene.points.push_back(whole.points[p]);
  for (const uint32_t i : compact.indices) {
    PlaneObservation o = observations[i];
    o.view = NewNumber(compact.views, o.view);
    o.point = NewNumber(compact.points, o.point);
    compact.observations.push_back(o);
  }
  return compact;
}

void Expand(const CompactScene& compact, PlaneScene* whole) {
  whole->camera() = compact.scene.camera();
  for (size_t v = 0; v < compact.views.size(); ++v) {
    whole->cams_from_world[compact.views[v]] = compact.scene.cams_from_world[v];
  }
  for (size_t p = 0; p < compact.points.size(); ++p)
    whole->points[compact.points[p]] = compact.scene.points[p];
}

}  // namespace veduta
