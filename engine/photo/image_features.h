// SPDX-License-Identifier: Apache-2.0
#pragma once
// One image's features as the engine uses them, and a bounded cache of them.

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "engine/camera/decoder.h"
#include "engine/matching/feature_grid.h"
#include "engine/matching/packed_descriptors.h"
#include "storage/base/lru_cache.h"
#include "storage/base/status.h"
#include "storage/database.h"
#include "storage/model/pinhole.h"

namespace veduta {

// The features of one image. Immutable once made.
struct ImageFeatures {
  // Whether they stay laid out for matching, which takes half as much memory again: of a photo that
  // is matched with many.
  enum class Packing : uint8_t { kOnDemand, kKept };

  ImageId id;
  CameraModel lens;  // by which the features lie where they lie
  Pinhole camera;    // of the lens
  uint32_t width_px = 0, height_px = 0;
  std::shared_ptr<const Features> features;  // all of them
  std::shared_ptr<const FeatureGrid> grid;   // where all of them lie
  uint32_t matched_count_max = 0;
  std::shared_ptr<const PackedDescriptors> kept;  // Packed(); null: not kept

  // The strongest ones, matched_count_max at most, laid out for matching. About 0.1 ms where they
  // are not kept.
  std::shared_ptr<const PackedDescriptors> Packed() const;
  // Memory that it takes, about.
  size_t size_bytes() const;

  // kInvalidArgument when matched_count_max exceeds kPackedCountMax, or the features do not have as
  // many descriptors as keypoints.
  static Result<std::shared_ptr<const ImageFeatures>> Make(ImageId id, const CameraModel& camera,
                                                           std::shared_ptr<const Features> features,
                                                           uint32_t matched_count_max,
                                                           Packing packing = Packing::kOnDemand);
};

// A stored image that is matched.
struct MatchedImage {
  ImageId id;
  std::shared_ptr<const Features> features = {};  // all of them; null: the cache has or reads them
};

// Matches of two stored images' packed features, as MatchMutual (mutual_matcher.h) gives them.
struct PutativeMatches {
  std::vector<FeatureMatch> from_first;   // of (first, second)
  std::vector<FeatureMatch> from_second;  // of (second, first)
};

// A bounded cache of stored images' features and of matches between them, least recently used out
// first; the newest stays, however large. Thread-safe. Two threads that miss at once both load, and
// one result is kept.
class ImageFeatureCache final {
 public:
  // Matches take up to a sixth of the bytes. The decoder must outlive the cache.
  ImageFeatureCache(size_t size_bytes_max, uint32_t matched_count_max,
                    const PhotoDecoder& decoder = DecoderInProcess())
      : cache_(size_bytes_max - size_bytes_max / 6),
        matches_(size_bytes_max / 6),
        matched_count_max_(matched_count_max),
        decoder_(decoder) {}

  // kNotFound where the image has no stored features. Damaged ones are derived from the photo,
  // which takes about a second; kCorruption where that fails.
  Result<std::shared_ptr<const ImageFeatures>> Get(const Snapshot& snapshot, ImageId id);
  // All features of a stored image as a lens of its camera's has them; not kept. Errors as of Get.
  Result<std::shared_ptr<const Features>> Read(const Snapshot& snapshot, const ImageRecord& image,
                                               const CameraRecord& camera) const;
  // The matches of two images, first < second, by a ratio test of `ratio_max` (MatchOptions). They
  // are kept because images are adjusted again and again with the same ones beside them. Errors as
  // of Get.
  Result<std::shared_ptr<const PutativeMatches>> Match(const Snapshot& snapshot,
                                                       const MatchedImage& first,
                                                       const MatchedImage& second,
                                                       double ratio_max);
  // Keeps the features of an image that was just stored with this photo, unless they are kept
  // already; not laid out for matching.
  void Put(const ContentHash& photo, std::shared_ptr<const ImageFeatures> features);
  // Keeps those no longer that an image had with this photo, which is gone.
  void Forget(ImageId id, const ContentHash& photo) { cache_.Erase({id, photo}); }
  // Gives up all that it keeps: what is wanted is read again.
  void Clear() {
    cache_.Clear();
    matches_.Clear();
  }
  uint32_t matched_count_max() const { return matched_count_max_; }

 private:
  Result<PackedDescriptors> Pack(const Snapshot& snapshot, const MatchedImage& image);

  // An image may have another photo in a later snapshot.
  struct Key {
    ImageId id;
    ContentHash photo;
    bool operator==(const Key&) const = default;
  };
  struct MatchKey {
    Key first, second;
    double ratio_max = 0;
    bool operator==(const MatchKey&) const = default;
  };
  struct HashOfKey {
    size_t operator()(const Key& key) const { return std::hash<ImageId>()(key.id); }
    size_t operator()(const MatchKey& key) const {
      return std::hash<uint64_t>()(static_cast<uint64_t>(key.first.id.value) << 32 |
                                   key.second.id.value);
    }
  };

  LruCache<Key, std::shared_ptr<const ImageFeatures>, HashOfKey> cache_;  // costs are bytes
  LruCache<MatchKey, std::shared_ptr<const PutativeMatches>, HashOfKey> matches_;
  const uint32_t matched_count_max_;
  const PhotoDecoder& decoder_;
};

}  // namespace veduta
