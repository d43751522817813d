// SPDX-License-Identifier: Apache-2.0
// Images, and what is found by their names and by their photos.
#include <cmath>

#include "engine/camera/exif.h"
#include "engine/camera/orientation.h"
#include "engine/camera/photo_header.h"
#include "engine/camera/projection.h"
#include "engine/query/checked_city.h"
#include "engine/query/stored_records.h"
#include "storage/record_counts.h"

namespace veduta {
namespace {

bool IsPlaced(Verdict verdict) {
  return verdict != Verdict::kRejected && verdict != Verdict::kPostponed;
}

// Whether the reason is one that leads to the verdict (storage/model/verdict.h).
bool Agree(Verdict verdict, Reason reason) {
  switch (verdict) {
    case Verdict::kPlaced:
      return reason == Reason::kRegistered || reason == Reason::kPropagated;
    case Verdict::kMerged:
      return reason == Reason::kJoinedReconstructions;
    case Verdict::kFounded:
      return reason == Reason::kGoodTriple;
    case Verdict::kPostponed:
      return reason >= Reason::kNoCandidates && reason < Reason::kUnreadable;
    case Verdict::kRejected:
      return reason >= Reason::kUnreadable;
  }
  return false;
}

std::string Text(const DatabaseCounts& counts) {
  return std::to_string(counts.images) + " images (" + std::to_string(counts.placed) + " placed, " +
         std::to_string(counts.postponed) + " postponed, " + std::to_string(counts.rejected) +
         " rejected, " + std::to_string(counts.located) + " with GPS) and " +
         std::to_string(counts.cameras) + " cameras";
}

DatabaseCounts Count(const CheckedCity& city) {
  DatabaseCounts counts;
  counts.images = city.images.size();
  counts.cameras = city.cameras.size();
  for (const auto& [id, image] : city.images) {
    ++(IsPlaced(image.verdict)                ? counts.placed
       : image.verdict == Verdict::kPostponed ? counts.postponed
                                              : counts.rejected);
    if (image.gps) ++counts.located;
  }
  return counts;
}

// Ids are given one after the other, and cameras and reconstructions are never deleted.
// CheckJournal asks the same of images, since it knows which were removed.
template <typename Records>
void ExpectAllIds(const Records& records, uint32_t next, const std::string& what,
                  Violations* violations) {
  const uint32_t last = records.empty() ? 0 : records.rbegin()->first.value;
  violations->Expect(records.size() == last, [&] {
    return "there are " + std::to_string(records.size()) + " " + what +
           ", and the last is number " + std::to_string(last);
  });
  violations->Expect(last + 1 == next, [&] {
    return "the last of the " + what + " is number " + std::to_string(last) +
           ", and the state gives the next one number " + std::to_string(next);
  });
}

void CheckState(const CheckedCity& city, Violations* violations) {
  const DatabaseState& state = city.state;
  const DatabaseCounts found = Count(city);
  violations->Expect(!state.counts || *state.counts == found, [&] {
    return "the state counts " + Text(*state.counts) + ", and there are " + Text(found);
  });
  ExpectAllIds(city.cameras, state.next_camera, "cameras", violations);
  ExpectAllIds(city.reconstructions, state.next_reconstruction, "reconstructions", violations);
  const uint64_t retrievable = found.images - found.rejected;
  violations->Expect(retrievable == state.retrievable_image_count, [&] {
    return std::to_string(retrievable) + " images have features, the state says " +
           std::to_string(state.retrievable_image_count);
  });
  std::set<ImageId> pending;
  for (const ImageId id : state.pending_propagation) {
    violations->Expect(city.HasFeatures(id), [&] {
      return NameOf(id) + " is to be tried again, and there is no such image with features";
    });
    violations->Expect(pending.insert(id).second,
                       [&] { return NameOf(id) + " is to be tried again twice"; });
  }
}

// One image against its camera, its verdict and its features.
void CheckImage(const CheckedCity& city, const ImageRecord& image, Violations* violations) {
  const std::string name = NameOf(image.id);
  violations->Expect(Agree(image.verdict, image.reason), [&] {
    return name + " has verdict " + std::to_string(static_cast<int>(image.verdict)) +
           " for reason " + std::to_string(static_cast<int>(image.reason)) +
           ", which does not lead to it";
  });
  const auto camera = city.cameras.find(image.camera);
  violations->Expect(camera != city.cameras.end(), [&] {
    return name + " was taken by " + NameOf(image.camera) + ", which does not exist";
  });
  if (image.verdict == Verdict::kRejected || camera == city.cameras.end()) return;
  const CameraModel& model = camera->second.model;
  violations->Expect(model.width_px == image.width_px && model.height_px == image.height_px, [&] {
    return name + " has " + std::to_string(image.width_px) + "x" + std::to_string(image.height_px) +
           " px, its camera " + std::to_string(model.width_px) + "x" +
           std::to_string(model.height_px);
  });
}

// Every name and hash leads to an image that has it, and every image is found.
Status CheckIndexes(const CheckedCity& city, Violations* violations) {
  std::set<ImageId> named, hashed;
  VEDUTA_RETURN_IF_ERROR(WalkRecords<NameEntry>(
      city.snapshot, Family::kNames, violations, [&](const NameEntry& entry) {
        const auto image = city.images.find(entry.image);
        const bool leads_to_owner = image != city.images.end() &&
                                    image->second.name == entry.name.name &&
                                    image->second.contributor == entry.name.contributor;
        violations->Expect(leads_to_owner, [&] {
          return "the name " + entry.name.name + " of contributor " + entry.name.contributor +
                 " leads to " + NameOf(entry.image) + ", which is not called so or does not exist";
        });
        named.insert(entry.image);
      }));
  VEDUTA_RETURN_IF_ERROR(WalkRecords<HashEntry>(
      city.snapshot, Family::kHashes, violations, [&](const HashEntry& entry) {
        const bool leads_to_owner =
            city.HasFeatures(entry.image) && city.images.at(entry.image).photo == entry.photo;
        violations->Expect(leads_to_owner, [&] {
          return "the hash " + entry.photo.Hex() + " leads to " + NameOf(entry.image) +
                 ", which has another photo, is rejected or does not exist";
        });
        hashed.insert(entry.image);
      }));
  for (const auto& [id, image] : city.images) {
    violations->Expect(image.reason == Reason::kNameTaken || named.contains(id),
                       [&, id = id, &image = image] {
                         return NameOf(id) + " is not found by its name " + image.name;
                       });
    violations->Expect(image.verdict == Verdict::kRejected || hashed.contains(id),
                       [id = id] { return NameOf(id) + " is not found by its photo's hash"; });
  }
  return Status::Ok();
}

// The features again, from the photo: with one version of the decoders they depend on it and on its
// camera alone, bit for bit. The failure where they cannot be extracted.
Status CompareFeatures(const CheckedCity& city, const ImageRecord& image,
                       std::span<const uint8_t> photo, Violations* violations) {
  const auto camera = city.cameras.find(image.camera);
  const Result<Features> stored = city.snapshot.GetFeatures(image.photo);
  if (camera == city.cameras.end() || !stored.ok()) return Status::Ok();  // other checks say so
  const PhotoSource source{image.name, image.name,
                           std::vector<uint8_t>(photo.begin(), photo.end())};
  const PreparedPhoto again = city.preparer->Extract(source, camera->second.extraction_model(),
                                                     StoredLayout(image.orientation));
  VEDUTA_RETURN_IF_ERROR(again.failure);
  violations->Expect(
      again.reason == Reason::kNone && again.features.keypoints == stored->keypoints &&
          again.features.descriptors == stored->descriptors,
      [&] {
        return NameOf(image.id) +
               ": its features are not those that are extracted from its photo now: one of both is "
               "damaged, or another version of the program or of a decoder extracted them";
      });
  return Status::Ok();
}

using Owners = std::map<ContentHash, ImageId>;

// Reports what is stored under a hash that no image has and no mark names.
void ExpectOwned(const CheckedCity& city, const Owners& owners, const ContentHash& photo,
                 const std::string& what, Violations* violations) {
  violations->Expect(owners.contains(photo) || city.photos_ahead.contains(photo),
                     [&] { return what + " " + photo.Hex() + " belongs to no image"; });
}

Status CheckPhoto(const CheckedCity& city, const ImageRecord& image, std::string_view value,
                  Violations* violations) {
  const std::span<const uint8_t> bytes(reinterpret_cast<const uint8_t*>(value.data()),
                                       value.size());
  violations->Expect(HashContent(bytes) == image.photo,
                     [&] { return NameOf(image.id) + ": the stored photo has another hash"; });
  violations->Expect(bytes.size() == image.size_bytes, [&] {
    return NameOf(image.id) + ": the stored photo has " + std::to_string(bytes.size()) +
           " bytes, not " + std::to_string(image.size_bytes);
  });
  if (!city.deep) return Status::Ok();
  const PhotoHeader header = ReadPhotoHeader(bytes);
  const ImageSize recorded{image.width_px, image.height_px};
  const bool is_upright = UprightSize(header.stored_size, header.orientation) == recorded,
             is_as_stored = header.stored_size == recorded;
  violations->Expect(header.outcome == HeaderOutcome::kRead && (is_upright || is_as_stored), [&] {
    return NameOf(image.id) + ": the stored photo is not of the recorded size";
  });
  // One that was added before its orientation was noted has none.
  violations->Expect(
      image.orientation == 0 || (image.orientation == 1 && is_upright) ||
          (image.orientation == header.orientation && is_as_stored),
      [&] { return NameOf(image.id) + ": the stored photo does not say that it is turned so"; });
  // One that was added before positions were read has none.
  violations->Expect(!image.gps || HoldsExifGps(header.exif, *image.gps), [&] {
    return NameOf(image.id) + ": the stored photo does not say that it was taken there";
  });
  violations->Expect(!image.taken || image.taken == ReadExifTaken(header.exif), [&] {
    return NameOf(image.id) + ": the stored photo does not say that it was taken then";
  });
  if (city.preparer == nullptr) return Status::Ok();
  return CompareFeatures(city, image, bytes, violations);
}

// Features as extraction leaves them: within the photo, strongest first.
void CheckFeatures(const ImageRecord& image, const Features& features, Violations* violations) {
  violations->Expect(features.size() == image.feature_count, [&] {
    return NameOf(image.id) + " has " + std::to_string(features.size()) + " features, not " +
           std::to_string(image.feature_count);
  });
  const float width = static_cast<float>(image.width_px),
              height = static_cast<float>(image.height_px);
  bool is_inside = true, is_known = true, is_ordered = true;
  for (size_t i = 0; i < features.size(); ++i) {
    const Keypoint& k = features.keypoints[i];
    is_inside &= k.x_px >= -1 && k.y_px >= -1 && k.x_px <= width && k.y_px <= height;
    is_known &= k.scale_px > 0 && k.angle_deg >= 0 && k.angle_deg <= 360 && k.response >= 0 &&
                (k.contrast_sign == 1 || k.contrast_sign == -1);
    is_ordered &= i == 0 || k.response <= features.keypoints[i - 1].response;
  }
  violations->Expect(is_inside, [&] { return NameOf(image.id) + " has a feature beside itself"; });
  violations->Expect(is_known, [&] {
    return NameOf(image.id) + " has a feature of impossible scale, angle, response or sign";
  });
  violations->Expect(is_ordered, [&] {
    return NameOf(image.id) + ": its features are not in the order of their strength";
  });
}

Status CheckBlobs(const CheckedCity& city, Violations* violations) {
  Owners owners;
  for (const auto& [id, image] : city.images) {
    if (image.verdict != Verdict::kRejected) owners[image.photo] = id;
  }
  std::set<ContentHash> photos, features;
  Status failure;
  VEDUTA_RETURN_IF_ERROR(
      WalkStored(city.snapshot, Family::kPhotos, violations,
                 [&](std::string_view key, std::string_view value) {
                   HashEntry entry;
                   if (key.size() != entry.photo.bytes.size()) {
                     violations->Add(PlaceOf(Family::kPhotos, key) + ": a key of wrong length");
                     return;
                   }
                   std::copy(key.begin(), key.end(), entry.photo.bytes.begin());
                   photos.insert(entry.photo);
                   ExpectOwned(city, owners, entry.photo, "photo", violations);
                   const auto owner = owners.find(entry.photo);
                   if (owner != owners.end() && failure.ok())
                     failure = CheckPhoto(city, city.images.at(owner->second), value, violations);
                 }));
  VEDUTA_RETURN_IF_ERROR(failure);
  VEDUTA_RETURN_IF_ERROR(WalkRecords<FeaturesEntry>(
      city.snapshot, Family::kFeatures, violations, [&](const FeaturesEntry& entry) {
        features.insert(entry.photo);
        ExpectOwned(city, owners, entry.photo, "features of photo", violations);
        const auto owner = owners.find(entry.photo);
        if (owner != owners.end())
          CheckFeatures(city.images.at(owner->second), entry.features, violations);
      }));
  for (const auto& [photo, id] : owners) {
    violations->Expect(photos.contains(photo),
                       [id = id] { return NameOf(id) + " has no photo that can be read"; });
    violations->Expect(features.contains(photo),
                       [id = id] { return NameOf(id) + " has no features that can be read"; });
  }
  return Status::Ok();
}

}  // namespace

Status CheckImages(const CheckedCity& city, Violations* violations) {
  CheckState(city, violations);
  std::set<std::pair<std::string, std::string>> names;
  for (const auto& [id, image] : city.images) {
    CheckImage(city, image, violations);
    const bool is_alone =
        image.reason == Reason::kNameTaken || names.insert({image.contributor, image.name}).second;
    violations->Expect(is_alone, [id = id, &image = image] {
      return NameOf(id) + " shares its name " + image.name + " with another of contributor " +
             image.contributor;
    });
  }
  for (const auto& [id, camera] : city.cameras) {
    Status usable = CheckCamera(camera.model);
    if (usable.ok() && camera.refined_from) usable = CheckCamera(*camera.refined_from);
    violations->Expect(usable.ok(), [&, id = id] { return NameOf(id) + ": " + usable.message(); });
  }
  VEDUTA_RETURN_IF_ERROR(CheckIndexes(city, violations));
  return CheckBlobs(city, violations);
}

}  // namespace veduta
