// SPDX-License-Identifier: Apache-2.0
#include "engine/photo/image_features.h"

#include <span>

#include "engine/camera/projection.h"
#include "engine/camera/undistorter.h"
#include "engine/matching/mutual_matcher.h"
#include "engine/photo/derived_features.h"

namespace veduta {
namespace {

std::vector<FeatureMatch> FeaturesOf(std::span<const DescriptorMatch> found) {
  std::vector<FeatureMatch> matches;
  matches.reserve(found.size());
  for (const DescriptorMatch& match : found) matches.push_back({match.a, match.b});
  return matches;
}

}  // namespace

std::shared_ptr<const PackedDescriptors> ImageFeatures::Packed() const {
  if (kept) return kept;
  Result<PackedDescriptors> packed = PackedDescriptors::Pack(*features, matched_count_max);
  VEDUTA_CHECK(packed.ok(), packed.status().message());  // Make has seen to that
  return std::make_shared<const PackedDescriptors>(*std::move(packed));
}

size_t ImageFeatures::size_bytes() const {
  return sizeof(*this) + features->descriptors.size() +
         features->keypoints.size() * sizeof(Keypoint) + grid->size_bytes() +
         (kept ? kept->size_bytes() : 0);
}

Result<std::shared_ptr<const ImageFeatures>> ImageFeatures::Make(
    ImageId id, const CameraModel& camera, std::shared_ptr<const Features> features,
    uint32_t matched_count_max, Packing packing) {
  VEDUTA_RETURN_IF_ERROR(PackedDescriptors::Check(*features, matched_count_max));
  auto made = std::make_shared<ImageFeatures>();
  made->id = id;
  made->lens = camera;
  made->camera = Pinhole(camera);
  made->width_px = camera.width_px;
  made->height_px = camera.height_px;
  made->features = std::move(features);
  made->grid = std::make_shared<const FeatureGrid>(*made->features);
  made->matched_count_max = matched_count_max;
  if (packing == Packing::kKept) made->kept = made->Packed();
  return std::shared_ptr<const ImageFeatures>(std::move(made));
}

Result<std::shared_ptr<const ImageFeatures>> ImageFeatureCache::Get(const Snapshot& snapshot,
                                                                    ImageId id) {
  VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, snapshot.GetImage(id));
  VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera, snapshot.GetCamera(image.camera));
  const auto load = [&]() -> Result<std::shared_ptr<const ImageFeatures>> {
    VEDUTA_ASSIGN_OR_RETURN(auto features, Read(snapshot, image, camera));
    return ImageFeatures::Make(id, camera.model, std::move(features), matched_count_max_);
  };
  VEDUTA_ASSIGN_OR_RETURN(auto known,
                          cache_.GetOrMake({id, image.photo}, load,
                                           [](const auto& made) { return made->size_bytes(); }));
  if (known->lens == camera.model) return known;
  // The lens was refined since, or is another one in this snapshot.
  VEDUTA_ASSIGN_OR_RETURN(auto renewed, load());
  cache_.Erase({id, image.photo});
  Put(image.photo, renewed);
  return renewed;
}

Result<std::shared_ptr<const Features>> ImageFeatureCache::Read(const Snapshot& snapshot,
                                                                const ImageRecord& image,
                                                                const CameraRecord& camera) const {
  for (const CameraModel& model : {camera.model, camera.extraction_model()}) {
    if (const Status usable = CheckCamera(model); !usable.ok()) {
      return Status::Corruption("family cameras: camera " + std::to_string(camera.id.value) + ": " +
                                usable.message());
    }
  }
  UndistortCache tables(0);
  VEDUTA_ASSIGN_OR_RETURN(Features features,
                          ReadOrDeriveFeatures(snapshot, image, camera, &tables, decoder_));
  if (features.size() != image.feature_count) {
    return Status::Corruption("family features: photo " + image.photo.Hex() + " has " +
                              std::to_string(features.size()) + " features, and image " +
                              std::to_string(image.id.value) + " says " +
                              std::to_string(image.feature_count));
  }
  return std::make_shared<const Features>(std::move(features));
}

Result<PackedDescriptors> ImageFeatureCache::Pack(const Snapshot& snapshot,
                                                  const MatchedImage& image) {
  if (image.features) return PackedDescriptors::Pack(*image.features, matched_count_max_);
  VEDUTA_ASSIGN_OR_RETURN(const auto stored, Get(snapshot, image.id));
  return PackedDescriptors::Pack(*stored->features, matched_count_max_);
}

Result<std::shared_ptr<const PutativeMatches>> ImageFeatureCache::Match(const Snapshot& snapshot,
                                                                        const MatchedImage& first,
                                                                        const MatchedImage& second,
                                                                        double ratio_max) {
  VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image_a, snapshot.GetImage(first.id));
  VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image_b, snapshot.GetImage(second.id));
  const MatchKey key{{first.id, image_a.photo}, {second.id, image_b.photo}, ratio_max};
  const auto match = [&]() -> Result<std::shared_ptr<const PutativeMatches>> {
    VEDUTA_ASSIGN_OR_RETURN(const PackedDescriptors a, Pack(snapshot, first));
    VEDUTA_ASSIGN_OR_RETURN(const PackedDescriptors b, Pack(snapshot, second));
    MatchOptions options;
    options.ratio_max = ratio_max;
    const MatchesBothWays found = MatchBothWays(a, b, options);
    return std::make_shared<const PutativeMatches>(
        PutativeMatches{FeaturesOf(found.from_a), FeaturesOf(found.from_b)});
  };
  return matches_.GetOrMake(key, match, [](const auto& made) {
    return sizeof(*made) +
           (made->from_first.size() + made->from_second.size()) * sizeof(FeatureMatch);
  });
}

void ImageFeatureCache::Put(const ContentHash& photo,
                            std::shared_ptr<const ImageFeatures> features) {
  const ImageId id = features->id;
  if (features->kept) {
    auto alone = std::make_shared<ImageFeatures>(*features);
    alone->kept.reset();
    features = std::move(alone);
  }
  const size_t size_bytes = features->size_bytes();
  cache_.Put({id, photo}, std::move(features), size_bytes);
}

}  // namespace veduta
