// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/georeferencing.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include "engine/camera/orientation.h"
#include "engine/earth/earth_fit.h"
#include "engine/earth/earth_pose.h"
#include "engine/earth/local_frame.h"
#include "engine/ingest/hypotheses.h"
#include "engine/journal/journal.h"
#include "engine/query/ground_sightings.h"
#include "engine/query/living.h"

namespace veduta {
namespace {

// What a phone between houses is good for, where it does not say: metres, one standard deviation.
// Heights are worse. All chosen by hand; not measured.
constexpr double kAccuracy = 8, kHeightShare = 3, kHeightDeviation = 15, kNoHeight = 1000;
// A receiver that is better than this knows its height as well, and what it is above.
constexpr double kSurveyed = 1;
// A place is published where the fit is as sure as this. Chosen by hand; not measured.
constexpr double kHeadingDeviationDegMax = 20, kScaleDeviationMax = 0.25;
constexpr size_t kAgreeingMin = 3;
// An origin that is farther off is of another place. It makes no number less exact.
constexpr double kOriginDistanceMax = 50'000;

// What a look is made from.
struct Told {
  std::vector<Rigid3> cams;  // of the photos upright
  struct Fix {
    Eigen::Vector3d center;
    GpsFix gps;
    uint32_t contributor = 0;  // counted from 1
  };
  std::vector<Fix> fixes;
  std::vector<EarthHeading> headings;
  std::span<const GroundPoint> points;
  std::vector<SeenGroundPoint> seen;
};

Result<Told> WhatIsTold(const Snapshot& snapshot, ReconstructionId reconstruction,
                        std::span<const GroundPoint> points) {
  Told told;
  told.points = points;
  std::map<std::string, uint32_t> contributors;
  Status inner;
  VEDUTA_RETURN_IF_ERROR(snapshot.ScanPoses([&](const PoseRecord& pose) {
    if (pose.reconstruction != reconstruction) return true;
    Result<ImageRecord> image = snapshot.GetImage(pose.image);
    inner = image.status();
    if (!inner.ok()) return false;
    const Rigid3 upright_from_cam{Eigen::Quaterniond(UprightCamFromStoredCam(image->orientation)),
                                  Eigen::Vector3d::Zero()};
    told.cams.push_back(upright_from_cam * pose.cam_from_world);
    if (!image->gps) return true;
    const auto next = static_cast<uint32_t>(contributors.size() + 1);
    const uint32_t contributor = contributors.try_emplace(image->contributor, next).first->second;
    told.fixes.push_back({pose.cam_from_world.Center(), *image->gps, contributor});
    if (image->gps->heading_deg) {
      const Eigen::Vector3d forward =
          pose.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ();
      told.headings.push_back({forward, *image->gps->heading_deg, contributor});
    }
    return true;
  }));
  VEDUTA_RETURN_IF_ERROR(inner);
  VEDUTA_ASSIGN_OR_RETURN(told.seen, SeeGroundPoints(snapshot, points));
  std::erase_if(told.seen,
                [&](const SeenGroundPoint& seen) { return seen.reconstruction != reconstruction; });
  return told;
}

double MedianOf(std::vector<double> numbers) {
  const auto middle = numbers.begin() + static_cast<ptrdiff_t>(numbers.size() / 2);
  std::nth_element(numbers.begin(), middle, numbers.end());
  return *middle;
}

// In the middle of what is told, in round numbers.
GeoPosition MiddleOf(const Told& told) {
  std::vector<double> latitudes, longitudes, heights;
  for (const Told::Fix& fix : told.fixes) {
    latitudes.push_back(fix.gps.latitude_deg);
    longitudes.push_back(fix.gps.longitude_deg);
    if (fix.gps.height_m) heights.push_back(*fix.gps.height_m);
  }
  for (const SeenGroundPoint& seen : told.seen) {
    const GeoPosition& position = told.points[seen.point].position;
    latitudes.push_back(position.latitude_deg);
    longitudes.push_back(position.longitude_deg);
    heights.push_back(position.height_m);
  }
  const auto round = [](double number, double steps) { return std::round(number * steps) / steps; };
  return {round(MedianOf(std::move(latitudes)), 1e4), round(MedianOf(std::move(longitudes)), 1e4),
          heights.empty() ? 0 : round(MedianOf(std::move(heights)), 1)};
}

GeoPosition OriginFor(const Told& told, const Georeference& before) {
  const GeoPosition middle = MiddleOf(told);
  if (!before.place) return middle;
  const GeoPosition& kept = before.place->origin;
  return LocalFrame(kept).FromGeo(middle).norm() <= kOriginDistanceMax ? kept : middle;
}

// First the fixes, then the surveyed points.
std::vector<EarthAnchor> AnchorsOf(const Told& told, const LocalFrame& frame, double scale) {
  std::vector<EarthAnchor> anchors;
  for (const Told::Fix& fix : told.fixes) {
    const GpsFix& gps = fix.gps;
    const double accuracy = gps.accuracy_m > 0 ? gps.accuracy_m : kAccuracy;
    double above = kHeightShare * accuracy;
    if (accuracy > kSurveyed) above = std::max(above, kHeightDeviation);
    if (!gps.height_m) above = kNoHeight;
    anchors.push_back(
        {fix.center,
         frame.FromGeo({gps.latitude_deg, gps.longitude_deg, gps.height_m.value_or(0)}),
         {accuracy, accuracy, above},
         fix.contributor,
         accuracy > kSurveyed});
  }
  for (const SeenGroundPoint& seen : told.seen) {
    const GroundPoint& point = told.points[seen.point];
    const double deviation = std::hypot(point.deviation_m, scale * seen.deviation);
    anchors.push_back(
        {seen.world, frame.FromGeo(point.position), Eigen::Vector3d::Constant(deviation)});
  }
  return anchors;
}

FitTally TallyOf(const EarthFit& fit, size_t begin, size_t end) {
  FitTally tally;
  tally.used = static_cast<uint32_t>(end - begin);
  double squares = 0;
  for (size_t i = begin; i < end; ++i) {
    if (!fit.agrees[i]) continue;
    ++tally.agreeing;
    squares += fit.error_m[i].squaredNorm();
  }
  if (tally.agreeing > 0) tally.error_m = std::sqrt(squares / tally.agreeing);
  return tally;
}

bool IsSure(const EarthFit& fit) {
  const auto agreeing = static_cast<size_t>(std::ranges::count(fit.agrees, true));
  return agreeing >= kAgreeingMin && 2 * agreeing >= fit.agrees.size() &&
         fit.heading_deviation_deg <= kHeadingDeviationDegMax &&
         fit.scale_deviation <= kScaleDeviationMax;
}

std::optional<EarthPlace> FindPlace(const Told& told, const Georeference& before) {
  if (told.fixes.size() + told.seen.size() < kAgreeingMin) return std::nullopt;
  EarthPlace place;
  place.origin = OriginFor(told, before);
  const LocalFrame frame(place.origin);
  const std::vector<UpDirection> up = FindUp(told.cams);
  std::optional<EarthFit> fit = FitEarth(AnchorsOf(told, frame, 0), told.headings, up);
  // How exactly a surveyed point is seen, in metres, is known only once the scale is.
  if (fit && !told.seen.empty())
    fit = FitEarth(AnchorsOf(told, frame, fit->enu_from_world.scale), told.headings, up);
  if (!fit || !IsSure(*fit)) return std::nullopt;
  place.enu_from_world = fit->enu_from_world;
  place.pivot = fit->pivot;
  place.covariance = PackCovariance(fit->covariance);
  place.fixes = TallyOf(*fit, 0, told.fixes.size());
  place.ground_points = TallyOf(*fit, told.fixes.size(), fit->agrees.size());
  return place;
}

std::string Metres(double metres) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.3g m", metres);
  return text;
}

std::string TextOf(const Georeference& georeference) {
  const std::string version = "place " + std::to_string(georeference.version);
  if (!georeference.place) return version + " is not known any more: too little tells it";
  const auto told = [](const FitTally& tally, const std::string& what) {
    if (tally.used == 0) return std::string();
    return ", " + std::to_string(tally.agreeing) + " of " + std::to_string(tally.used) + " " +
           what + " agree to " + Metres(tally.error_m);
  };
  return version + told(georeference.place->fixes, "GPS positions") +
         told(georeference.place->ground_points, "surveyed points");
}

// Merges were refused by where this reconstruction was on the earth.
Status JudgeFarApartAnew(ReconstructionId reconstruction, const WriteScope& scope) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<HypothesisRecord> all, scope.base->ListHypotheses());
  for (const HypothesisRecord& hypothesis : all) {
    const bool is_of_it = hypothesis.a == reconstruction || hypothesis.b == reconstruction;
    if (!is_of_it || hypothesis.reason != RefusalReason::kFarApart) continue;
    VEDUTA_RETURN_IF_ERROR(
        MakeHypothesisDue(*scope.base, hypothesis.a, hypothesis.b, scope.transaction.get()));
  }
  return Status::Ok();
}

// Puts the record and, where there is something to tell, an entry of the journal.
Status Look(const ReconstructionRecord& before, std::span<const GroundPoint> points, bool is_told,
            const std::string& actor, const WriteScope& scope, DatabaseState* state) {
  ReconstructionRecord record = before;
  Georeference& now = record.georeference;
  now.place.reset();
  now.images_at_look = is_told ? record.image_count : 0;
  now.images_at_adjustment = is_told ? record.images_at_adjustment : 0;
  if (is_told) {
    VEDUTA_ASSIGN_OR_RETURN(const Told told, WhatIsTold(*scope.base, record.id, points));
    now.place = FindPlace(told, before.georeference);
  }
  if (now.place) ++now.version;
  if (now.place || before.georeference.place) {
    AppendJournal({0, 0, actor, "georeference", {}, record.id, TextOf(now)}, state,
                  scope.transaction.get());
    VEDUTA_RETURN_IF_ERROR(JudgeFarApartAnew(record.id, scope));
  }
  scope.transaction->PutReconstruction(record);
  return Status::Ok();
}

}  // namespace

Result<bool> IsPlaceTold(const Snapshot& snapshot, const DatabaseState& state) {
  if (state.counts && state.counts->located > 0) return true;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<GroundPoint> points, snapshot.ListGroundPoints());
  return !points.empty();
}

bool IsLookDue(const ReconstructionRecord& record, bool is_place_told) {
  if (!record.is_living()) return false;
  const Georeference& last = record.georeference;
  if (!is_place_told) return last.images_at_look > 0;
  return record.image_count < last.images_at_look ||
         record.images_at_adjustment != last.images_at_adjustment ||
         10 * static_cast<uint64_t>(record.image_count) >=
             11 * static_cast<uint64_t>(last.images_at_look) + 1;
}

Status LookForPlace(ReconstructionId reconstruction, WriteScope scope) {
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record,
                          scope.base->GetReconstruction(reconstruction));
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<GroundPoint> points, scope.base->ListGroundPoints());
  VEDUTA_ASSIGN_OR_RETURN(const bool is_told, IsPlaceTold(*scope.base, state));
  VEDUTA_RETURN_IF_ERROR(Look(record, points, is_told, "veduta", scope, &state));
  scope.transaction->PutState(state);
  return scope.transaction->Commit();
}

Status SetGroundPoints(std::span<const GroundPoint> points, const std::string& actor,
                       WriteScope scope) {
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, scope.base->GetState());
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<GroundPoint> before, scope.base->ListGroundPoints());
  for (const GroundPoint& point : before) scope.transaction->DeleteGroundPoint(point.name);
  for (const GroundPoint& point : points) scope.transaction->PutGroundPoint(point);
  AppendJournal({0, 0, actor, "ground", {}, {}, std::to_string(points.size()) + " points"}, &state,
                scope.transaction.get());
  const bool is_told = !points.empty() || (state.counts && state.counts->located > 0);
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ReconstructionRecord> living, ListLiving(*scope.base));
  for (const ReconstructionRecord& record : living) {
    if (!is_told && !IsLookDue(record, is_told)) continue;
    VEDUTA_RETURN_IF_ERROR(Look(record, points, is_told, actor, scope, &state));
  }
  scope.transaction->PutState(state);
  return scope.transaction->Commit();
}

}  // namespace veduta
