// SPDX-License-Identifier: Apache-2.0
// The members of Questions that give lists and bytes, for those who draw the city.
#include "engine/camera/photo_header.h"
#include "engine/engine.h"
#include "engine/parts.h"
#include "engine/photo/thumbnail.h"
#include "engine/query/city_answers.h"
#include "engine/query/even_order.h"
#include "engine/query/find_image.h"
#include "engine/query/living.h"
#include "engine/query/photo_search.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// The bytes of a photo that is stored: those of rejected ones are not.
Result<StoredBytes> BytesOf(const Snapshot& snapshot, const ImageRecord& image) {
  if (image.verdict == Verdict::kRejected)
    return Status::NotFound(image.name + " was rejected, and its photo is not stored");
  return snapshot.GetPhoto(image.photo);
}

}  // namespace

Result<std::vector<ListedImage>> Questions::Images(ImageId first, uint32_t count_max) const {
  const Snapshot& snapshot = *view_->snapshot;
  const Visibility visibility = view_->visibility();
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, snapshot.GetState());
  VEDUTA_ASSIGN_OR_RETURN(const auto unsure, view_->caches->unsure.Get(snapshot));
  std::vector<ListedImage> images;
  for (uint32_t id = std::max(first.value, 1u); id < state.next_image && images.size() < count_max;
       ++id) {
    Result<ImageRecord> image = snapshot.GetImage(ImageId(id));
    if (image.status().code() == StatusCode::kNotFound) continue;  // it was removed
    VEDUTA_RETURN_IF_ERROR(image.status());
    VEDUTA_ASSIGN_OR_RETURN(const bool sees, visibility.Sees(*image));
    if (!sees) continue;
    ListedImage& listed = images.emplace_back();
    VEDUTA_ASSIGN_OR_RETURN(listed.is_hidden, IsHidden(snapshot, *image));
    listed.id = image->id;
    listed.name = std::move(image->name);
    listed.contributor = std::move(image->contributor);
    listed.verdict = image->verdict;
    listed.orientation = image->orientation;
    VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, snapshot.FindPose(image->id));
    if (!pose) continue;
    listed.reconstruction = pose->reconstruction;
    listed.is_unsure = unsure->contains(image->id);
    if (!listed.is_unsure) listed.cam_from_world = ToPlain(pose->cam_from_world);
  }
  return images;
}

Result<FoundPhotos> Questions::SearchPhotos(const PhotoSearch& search) const {
  VEDUTA_ASSIGN_OR_RETURN(
      FoundPhotos found,
      veduta::SearchPhotos(*view_->snapshot, search, &view_->caches->unsure, view_->sight));
  found.snapshot = snapshot();
  return found;
}

Result<PhotoExtent> Questions::Extent() const {
  return ExtentOf(*view_->snapshot, &view_->caches->unsure, view_->sight);
}

Result<PhotoFile> Questions::Photo(const std::string& name) const {
  VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, FindImage(*view_->snapshot, name, view_->sight));
  VEDUTA_ASSIGN_OR_RETURN(const StoredBytes stored, BytesOf(*view_->snapshot, image));
  const std::span<const uint8_t> bytes = stored.bytes();
  const PhotoFormat format = view_->parts->preparer->decoder().Examine(bytes).header.format;
  return PhotoFile{MediaTypeOf(format), {bytes.begin(), bytes.end()}};
}

Result<PhotoFile> Questions::Original(const std::string& name) const {
  VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, FindImage(*view_->snapshot, name, view_->sight));
  Result<StoredBytes> stored = view_->snapshot->GetOriginal(image.id);
  if (stored.status().code() == StatusCode::kNotFound)
    return veduta::Status::NotFound("nothing of " + image.name + " was filled: it is as it came");
  VEDUTA_RETURN_IF_ERROR(stored.status());
  const std::span<const uint8_t> bytes = stored->bytes();
  const PhotoFormat format = view_->parts->preparer->decoder().Examine(bytes).header.format;
  return PhotoFile{MediaTypeOf(format), {bytes.begin(), bytes.end()}};
}

Result<PhotoFile> Questions::Thumbnail(const std::string& name, uint32_t side_px) const {
  VEDUTA_RETURN_IF_ERROR(OptionBounds().Between("side_px", side_px, 1, kThumbnailSideMax).status());
  VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, FindImage(*view_->snapshot, name, view_->sight));
  VEDUTA_ASSIGN_OR_RETURN(const StoredBytes stored, BytesOf(*view_->snapshot, image));
  const DecodedPhoto decoded = view_->parts->preparer->Decode(stored.bytes());
  if (decoded.outcome == DecodeOutcome::kNoMemory) return veduta::Status::NoMemory(decoded.detail);
  if (decoded.outcome != DecodeOutcome::kDecoded)
    return veduta::Status::Corruption(image.name + " cannot be decoded: " + decoded.detail);
  VEDUTA_ASSIGN_OR_RETURN(std::vector<uint8_t> jpeg, MakeThumbnail(decoded.bgr, side_px));
  return PhotoFile{MediaTypeOf(PhotoFormat::kJpeg), std::move(jpeg)};
}

Result<PointCloud> Questions::Points(ReconstructionId id) const {
  VEDUTA_RETURN_IF_ERROR(view_->RefuseUnseen(id));
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record, GetLiving(*view_->snapshot, id));
  PointCloud cloud;
  cloud.geometry_version = record.geometry_version;
  cloud.positions.reserve(record.point_count);
  cloud.rgb.reserve(record.point_count);
  VEDUTA_RETURN_IF_ERROR(
      view_->snapshot->ScanPointBlocks(id, record.points_generation, [&](const PointBlock& block) {
        for (const PointRecord& point : block.points) {
          const Eigen::Vector3f x = point.position.cast<float>();
          cloud.positions.push_back({x.x(), x.y(), x.z()});
          cloud.rgb.push_back(point.rgb);
        }
        return true;
      }));
  cloud.positions = InEvenOrder(cloud.positions);
  cloud.rgb = InEvenOrder(cloud.rgb);
  return cloud;
}

}  // namespace veduta
