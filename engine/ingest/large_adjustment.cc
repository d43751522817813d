// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/large_adjustment.h"

#include <utility>
#include <vector>

#include "engine/ingest/due_work.h"
#include "engine/ingest/reconstruction_adjustment.h"
#include "engine/ingest/submaps.h"

namespace veduta {
namespace {

// Every change of a pose or point counts in the geometry's version.
bool IsUnchanged(const ReconstructionRecord& was, const ReconstructionRecord& is) {
  return was.geometry_version == is.geometry_version &&
         was.points_generation == is.points_generation && was.image_count == is.image_count;
}

}  // namespace

LargeAdjustment::LargeAdjustment(const IngestParts& parts, ReconstructionId reconstruction)
    : parts_(parts), reconstruction_(reconstruction) {}

IngestParts LargeAdjustment::PartsWith(CityMap* map) const {
  return {parts_.database, parts_.retrieval, parts_.features, parts_.pool, parts_.options, map};
}

Status LargeAdjustment::Compute() {
  const std::shared_ptr<const Snapshot> base = parts_.database->GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(found_.record, base->GetReconstruction(reconstruction_));
  if (!found_.record.is_living()) return Status::Ok();
  VEDUTA_ASSIGN_OR_RETURN(const Submaps submaps, Submaps::Read(*base));
  is_relaxed_ =
      IsRelaxed(found_.record, submaps.IsParted(reconstruction_), parts_.options.schedule);
  if (is_relaxed_) {
    for (const SubmapId id : submaps.List(reconstruction_)) {
      const std::vector<ImageId>& images = submaps.Find(id)->images;
      found_.images.insert(images.begin(), images.end());
    }
    VEDUTA_RETURN_IF_ERROR(NoteForbidden(*base, &found_));
    VEDUTA_ASSIGN_OR_RETURN(relaxation_, FindRelaxation(*base, reconstruction_,
                                                        parts_.options.mapper.doubt, parts_.pool));
    return Status::Ok();
  }
  MapLoader loader(base, parts_.features, &found_.map, parts_.pool);
  std::vector<ImageId> images;
  VEDUTA_RETURN_IF_ERROR(loader.LoadReconstruction(reconstruction_, &images));
  found_.images.insert(images.begin(), images.end());
  VEDUTA_RETURN_IF_ERROR(NoteForbidden(*base, &found_));
  found_.before = ListCameras(found_.map, reconstruction_);
  VEDUTA_ASSIGN_OR_RETURN(found_.healing, AdjustReconstruction({&loader, &found_.map, parts_.pool,
                                                                parts_.options.mapper},
                                                               reconstruction_));
  if (!IsRefinementDue(found_.record)) return Status::Ok();
  WithLenses& other = with_lenses_.emplace();
  VEDUTA_ASSIGN_OR_RETURN(other.before, ListLenses(*base, found_.images));
  MapLoader other_loader(base, parts_.features, &other.map, parts_.pool);
  VEDUTA_ASSIGN_OR_RETURN(other.healing, AdjustReconstruction({&other_loader, &other.map,
                                                               parts_.pool, parts_.options.mapper},
                                                              reconstruction_, Lenses::kRefined));
  if (other.healing.lenses.empty()) with_lenses_.reset();
  return Status::Ok();
}

Result<AdjustedWhole> LargeAdjustment::Commit(CityMap* map) {
  WriteScope scope = BeginWrite(parts_.database);
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord now,
                          scope.base->GetReconstruction(reconstruction_));
  if (!now.is_living()) return AdjustedWhole();
  VEDUTA_ASSIGN_OR_RETURN(const bool is_due_anew, IsDueAnew(found_, now, *scope.base));
  if (is_relaxed_) {
    if (is_due_anew) return AdjustedWhole();
    return WriteRelaxation(PartsWith(map), reconstruction_, relaxation_, std::move(scope));
  }
  if (is_due_anew || !IsUnchanged(found_.record, now))
    return CarryOver(PartsWith(map), found_, std::move(scope));
  if (with_lenses_) {
    VEDUTA_ASSIGN_OR_RETURN(const LensesOfImages lenses, ListLenses(*scope.base, found_.images));
    if (lenses != with_lenses_->before) with_lenses_.reset();
  }
  map->Clear();  // it holds the poses and points of before
  return WriteAdjustedWhole(PartsWith(with_lenses_ ? &with_lenses_->map : &found_.map),
                            reconstruction_, with_lenses_ ? with_lenses_->healing : found_.healing,
                            std::move(scope));
}

}  // namespace veduta
