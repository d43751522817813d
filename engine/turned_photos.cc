// SPDX-License-Identifier: Apache-2.0
#include "engine/door/turned_photos.h"

#include "engine/camera/orientation.h"
#include "engine/camera/photo_header.h"
#include "engine/parts.h"

namespace veduta {
namespace {

bool IsTurned(const Snapshot& snapshot, const ImageRecord& image) {
  if (image.orientation > 1) return false;  // the image is as its file is
  const Result<StoredBytes> photo = snapshot.GetPhoto(image.photo);
  if (!photo.ok()) return false;
  const PhotoHeader header = ReadPhotoHeader(photo->bytes());
  return header.outcome == HeaderOutcome::kRead && header.orientation != 1 &&
         UprightSize(header.stored_size, header.orientation) ==
             ImageSize{image.width_px, image.height_px};
}

}  // namespace

Result<TurnedPhotos> FindTurnedPhotos(const Questions& ask) {
  const Snapshot& snapshot = *EngineParts::SnapshotOf(ask);
  std::set<ImageId> posed;
  VEDUTA_RETURN_IF_ERROR(snapshot.ScanPoses([&](const PoseRecord& pose) {
    posed.insert(pose.image);
    return true;
  }));
  TurnedPhotos turned;
  for (const ImageId id : posed) {
    VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, snapshot.GetImage(id));
    if (IsTurned(snapshot, image) && turned.count++ == 0) turned.first = image.name;
  }
  return turned;
}

}  // namespace veduta
