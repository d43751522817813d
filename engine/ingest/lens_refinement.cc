// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/lens_refinement.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>

#include "engine/camera/projection.h"
#include "engine/journal/camera_entry.h"
#include "engine/mapping/bundle_adjustment.h"
#include "engine/mapping/lens_projection.h"
#include "engine/photo/camera_group.h"

namespace veduta {
namespace {

// All chosen by hand. Lenses are refined at 12 images, and each time that there are so many times
// more.
constexpr uint32_t kImagesMin = 12, kImagesMax = 600;
constexpr double kGrowth = 1.5;
// By how much at least, over the longer side, rays must move in the photo where images of other
// reconstructions rest on the lens: as far as a corner does by 0.3 % of the focal length.
constexpr double kChangeMin = 0.0018;

// How far the rays through a corner of the photo, and halfway to it, move in it, over its longer
// side; the larger of both.
double ChangeOf(const CameraModel& before, const CameraModel& after) {
  double change_px = 0;
  for (const double share : {0.0, 0.25}) {
    const Eigen::Vector2d place(share * before.width_px, share * before.height_px);
    const auto ray = UndistortPixel(before, place);
    if (!ray) return 1;
    const Eigen::Vector2d moved =
        DistortPixel(after, PixelFromNormalized(after, NormalizedFromPixel(before, *ray)));
    change_px = std::max(change_px, (moved - place).norm());
  }
  return change_px / std::max(before.width_px, before.height_px);
}

// Whether the cameras straighten photos alike before features are extracted: one of them was
// refined where the other was not. Older programs kept k1 and k2 in step with the focal length.
bool IsOneLens(const CameraRecord& of_a, const CameraRecord& of_b) {
  const auto is_near = [](double x, double y) { return std::abs(x - y) <= 1e-9 * std::abs(x); };
  const CameraModel &a = of_a.extraction_model(), &b = of_b.extraction_model();
  const CameraModel scaled = ChangedLens(b, LensChange(std::log(a.fx / b.fx), 0, 0));
  return a.width_px == b.width_px && a.height_px == b.height_px && a.cx == b.cx && a.cy == b.cy &&
         a.u0 == b.u0 && a.v0 == b.v0 && is_near(a.k1, scaled.k1) && is_near(a.k2, scaled.k2);
}

// Cameras that began with one lens, and where images of them have their poses.
struct CameraFamily {
  std::vector<CameraRecord> cameras;  // ascending; the first is the one that is refined
  std::vector<ImageRecord> own, others;
  std::map<ReconstructionId, uint32_t> other_counts;
  std::set<CameraId> used;  // that have an image, with a pose or without

  const CameraRecord& main() const { return cameras.front(); }
  // Whether no other reconstruction has more images of them.
  bool IsMostlyOwn() const {
    return std::ranges::all_of(other_counts,
                               [&](const auto& other) { return other.second <= own.size(); });
  }
  // Whether its own images have one camera, and none that was kept for others.
  bool IsOne() const {
    return std::ranges::all_of(own,
                               [&](const ImageRecord& image) { return image.camera == main().id; });
  }
  // Whether images of the others rest on the lens that is refined.
  bool IsShared() const { return std::ranges::count(others, main().id, &ImageRecord::camera) > 0; }
};

// All families of cameras that may be refined, and have images in the reconstruction.
Result<std::vector<CameraFamily>> ListFamilies(const Snapshot& snapshot, ReconstructionId own) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<CameraRecord> cameras, snapshot.ListCameras());
  std::vector<CameraFamily> families;
  std::map<CameraId, size_t> family_of;
  std::multimap<std::pair<double, double>, size_t> by_center;  // the principal point is kept
  for (const CameraRecord& camera : cameras) {
    if (!camera.is_refinable) continue;
    const std::pair<double, double> center(camera.model.cx, camera.model.cy);
    const auto [begin, end] = by_center.equal_range(center);
    const auto known = std::find_if(begin, end, [&](const auto& entry) {
      const CameraRecord& main = families[entry.second].main();
      return IsNumberedName(camera.name, main.name) &&
             IsToldAlike(camera.told_focal_share, main.told_focal_share) && IsOneLens(main, camera);
    });
    const size_t family = known != end ? known->second : families.size();
    if (known == end) families.emplace_back();
    if (known == end) by_center.insert({center, family});
    families[family].cameras.push_back(camera);
    family_of[camera.id] = family;
  }
  Status read = Status::Ok();
  VEDUTA_RETURN_IF_ERROR(snapshot.ScanImages([&](const ImageRecord& image) {
    const auto family = family_of.find(image.camera);
    if (family == family_of.end()) return true;
    families[family->second].used.insert(image.camera);
    const Result<std::optional<PoseRecord>> pose = snapshot.FindPose(image.id);
    read = pose.status();
    if (!pose.ok() || !*pose) return pose.ok();
    CameraFamily& of = families[family->second];
    const bool is_own = (*pose)->reconstruction == own;
    (is_own ? of.own : of.others).push_back(image);
    if (!is_own) ++of.other_counts[(*pose)->reconstruction];
    return true;
  }));
  VEDUTA_RETURN_IF_ERROR(read);
  std::erase_if(families, [](const CameraFamily& family) { return family.own.empty(); });
  return families;
}

// Gives an image the features that its stored ones are by a lens of its camera's family.
Status SetLens(const MappingContext& context, ImageId id, const CameraRecord& camera) {
  const Snapshot& snapshot = context.loader->snapshot();
  VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, snapshot.GetImage(id));
  VEDUTA_ASSIGN_OR_RETURN(const auto features,
                          context.loader->features()->Read(snapshot, image, camera));
  context.map->SetLens(id, Pinhole(camera.model), features,
                       std::make_shared<const FeatureGrid>(*features));
  return Status::Ok();
}

// What a refinement changes of a map, to be put back to the last bit.
class MapAsItWas final {
 public:
  MapAsItWas(CityMap* map, std::span<const ImageId> images) : map_(map) {
    for (const ImageId id : images) poses_.push_back({id, map->image(id).cam_from_world});
    for (const PointId id : map->PointsSeenBy(images))
      points_.push_back({id, map->point(id).position});
  }

  // But for the lenses: points are measured anew by those that the images have.
  void PutBack() const {
    for (const auto& [id, pose] : poses_) map_->SetPose(id, pose);
    for (const auto& [id, position] : points_) map_->SetPosition(id, position);
  }

 private:
  CityMap* const map_;
  std::vector<std::pair<ImageId, Rigid3>> poses_;
  std::vector<std::pair<PointId, Eigen::Vector3d>> points_;
};

// The camera with another lens than the one that it had.
CameraRecord WithLens(CameraRecord camera, const CameraModel& model) {
  camera.refined_from = camera.extraction_model();
  camera.model = model;
  return camera;
}

// Refines the lenses of the families, whose images have that of their first camera.
Result<std::vector<RefinedLens>> Refine(const MappingContext& context,
                                        std::span<const ImageId> images,
                                        std::span<const CameraFamily> families) {
  std::map<ImageId, uint32_t> lens_of;
  std::vector<BundleLens> lenses;
  for (const CameraFamily& family : families) {
    for (const ImageRecord& image : family.own)
      lens_of[image.id] = static_cast<uint32_t>(lenses.size());
    lenses.push_back({family.main().model});
  }
  const LensSetter set_lens = [&](ImageId id, const CameraModel& model) {
    return SetLens(context, id, WithLens(families[lens_of.at(id)].main(), model));
  };
  VEDUTA_RETURN_IF_ERROR(AdjustBundleWithLenses(context.map, images,
                                                context.map->PointsSeenBy(images), lens_of,
                                                context.options.global_bundle, set_lens, lenses)
                             .status());
  std::vector<RefinedLens> refined;
  for (size_t i = 0; i < lenses.size(); ++i)
    refined.push_back({families[i].main().id, lenses[i].model, lenses[i].focal_stddev_share});
  return refined;
}

// Gives the families' images in the map the lens of their first camera, or the one of their own
// camera again.
Status SetLenses(const MappingContext& context, std::span<const CameraFamily> families,
                 bool is_main) {
  for (const CameraFamily& family : families) {
    for (const ImageRecord& image : family.own) {
      const auto own = std::ranges::find(family.cameras, image.camera, &CameraRecord::id);
      const CameraRecord& camera = is_main ? family.main() : *own;
      const Pinhole& now = context.map->image(image.id).camera;
      if (is_main && camera.id == own->id && now.fx == camera.model.fx) continue;
      VEDUTA_RETURN_IF_ERROR(SetLens(context, image.id, camera));
    }
  }
  return Status::Ok();
}

// Gives images of other reconstructions the camera as it was: another one of the family that is
// like that or that no image has any more, or a new one.
void KeepForOthers(CameraFamily* family, std::vector<CameraRecord>* known, DatabaseState* state,
                   Transaction* transaction) {
  CameraRecord kept = family->main();
  kept.awaited = nullptr;
  const auto others = std::span(family->cameras).subspan(1);
  auto at = std::ranges::find(others, kept.model, &CameraRecord::model);
  const bool is_there = at != others.end();
  if (!is_there) {
    at = std::ranges::find_if(
        others, [&](const CameraRecord& camera) { return !family->used.contains(camera.id); });
  }
  const bool is_new = at == others.end();
  const auto is_taken = [&](const std::string& name) {
    return std::ranges::count(*known, name, &CameraRecord::name) > 0;
  };
  kept.id = is_new ? CameraId(state->next_camera++) : at->id;
  kept.name = is_new ? NumberedName(kept.name, is_taken) : at->name;
  if (!is_there) PutNewCamera(kept, state, transaction);
  if (is_new) known->push_back(kept);
  for (ImageRecord& image : family->others) {
    if (image.camera != family->main().id) continue;
    image.camera = kept.id;
    transaction->PutImage(image);
  }
}

}  // namespace

Result<LensesOfImages> ListLenses(const Snapshot& snapshot, const std::set<ImageId>& images) {
  LensesOfImages lenses;
  for (const ImageId id : images) {
    VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, snapshot.GetImage(id));
    VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera, snapshot.GetCamera(image.camera));
    lenses.push_back({camera.id, camera.model});
  }
  return lenses;
}

bool IsRefinementDue(const ReconstructionRecord& record) {
  if (record.image_count < kImagesMin || record.image_count > kImagesMax) return false;
  if (record.images_at_adjustment == 0) return false;
  for (double step = kImagesMin; step <= record.image_count; step *= kGrowth)
    if (record.images_at_adjustment < step) return true;
  return false;
}

Result<std::vector<RefinedLens>> RefineLenses(const MappingContext& context,
                                              ReconstructionId reconstruction,
                                              std::span<const ImageId> images) {
  VEDUTA_ASSIGN_OR_RETURN(std::vector<CameraFamily> families,
                          ListFamilies(context.loader->snapshot(), reconstruction));
  std::erase_if(families, [](const CameraFamily& family) { return !family.IsMostlyOwn(); });
  if (families.empty()) return std::vector<RefinedLens>();
  const MapAsItWas before(context.map, images);
  VEDUTA_RETURN_IF_ERROR(SetLenses(context, families, /*is_main=*/true));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<RefinedLens> lenses, Refine(context, images, families));
  // What hardly changes is held: others would need cameras of their own for nothing.
  std::vector<CameraFamily> changing;
  for (size_t i = 0; i < families.size(); ++i) {
    const bool hardly_changes = ChangeOf(families[i].main().model, lenses[i].model) < kChangeMin;
    if (!hardly_changes || !families[i].IsShared() || !families[i].IsOne())
      changing.push_back(families[i]);
  }
  if (changing.size() == families.size()) return lenses;
  VEDUTA_RETURN_IF_ERROR(SetLenses(context, families, /*is_main=*/false));
  VEDUTA_RETURN_IF_ERROR(SetLenses(context, changing, /*is_main=*/true));
  before.PutBack();
  if (changing.empty()) return std::vector<RefinedLens>();
  return Refine(context, images, changing);
}

Result<std::vector<ImageId>> WriteLenses(const Snapshot& snapshot, ReconstructionId reconstruction,
                                         std::span<const RefinedLens> lenses, DatabaseState* state,
                                         Transaction* transaction) {
  std::vector<ImageId> changed;
  if (lenses.empty()) return changed;
  VEDUTA_ASSIGN_OR_RETURN(std::vector<CameraFamily> families,
                          ListFamilies(snapshot, reconstruction));
  VEDUTA_ASSIGN_OR_RETURN(std::vector<CameraRecord> known, snapshot.ListCameras());
  for (CameraFamily& family : families) {
    const auto lens = std::ranges::find(lenses, family.main().id, &RefinedLens::camera);
    if (lens == lenses.end()) continue;
    // There was no usable step, and nothing has changed.
    if (lens->model == family.main().model && lens->stddev_share == 0 && family.IsOne()) continue;
    if (family.IsShared()) KeepForOthers(&family, &known, state, transaction);
    CameraRecord refined = WithLens(family.main(), lens->model);
    refined.focal_stddev_share = lens->stddev_share;
    ++refined.version;
    PutNewCamera(refined, state, transaction);
    for (ImageRecord& image : family.own) {
      changed.push_back(image.id);
      if (image.camera == refined.id) continue;
      image.camera = refined.id;
      transaction->PutImage(image);
    }
  }
  return changed;
}

}  // namespace veduta
