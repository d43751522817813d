// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/retrieval/photo_sets.h"

#include <algorithm>
#include <set>

#include "engine/engine.h"
#include "engine/ingest/pair_verifier.h"
#include "engine/photo/photo_preparer.h"
#include "tools/bench/orders/order_list.h"
#include "tools/bench/orders/truth_folder.h"

namespace veduta::bench {
namespace {

constexpr uint32_t kMatchedCountMax = 1500;  // IngestOptions::matched_count_max
constexpr uint64_t kSeed = 1;                // of the verification; any

std::vector<std::string> SplitAt(const std::string& text, char separator) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == separator) {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

using Pair = std::pair<uint32_t, uint32_t>;  // first < second

std::vector<Pair> AllPairs(uint32_t count) {
  std::vector<Pair> pairs;
  for (uint32_t a = 0; a < count; ++a) {
    for (uint32_t b = a + 1; b < count; ++b) pairs.emplace_back(a, b);
  }
  return pairs;
}

std::vector<Pair> NearPairs(const std::vector<std::string>& names, const orders::Truth& truth,
                            uint32_t near_count) {
  std::vector<Eigen::Vector3d> centers;
  for (const std::string& name : names) {
    const auto found = truth.find(name);
    if (found == truth.end()) return AllPairs(static_cast<uint32_t>(names.size()));
    const Rigid3& cam_from_world = found->second;
    centers.push_back(-(cam_from_world.rotation.conjugate() * cam_from_world.translation));
  }
  std::set<Pair> pairs;
  for (uint32_t a = 0; a < centers.size(); ++a) {
    std::vector<std::pair<double, uint32_t>> others;
    for (uint32_t b = 0; b < centers.size(); ++b) {
      if (b != a) others.emplace_back((centers[a] - centers[b]).norm(), b);
    }
    std::sort(others.begin(), others.end());
    others.resize(std::min<size_t>(others.size(), near_count));
    for (const auto& [distance, b] : others) pairs.emplace(std::min(a, b), std::max(a, b));
  }
  return {pairs.begin(), pairs.end()};
}

// Extracts the photos of one set and appends them; the names of those that have features.
Result<std::vector<std::string>> Extract(const PhotoSet& set, ThreadPool* pool, Photos* photos) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<orders::OrderedPhoto> files,
                          orders::ListFolder(set.folder));
  UndistortCache tables(size_t{64} << 20);
  const PhotoPreparer preparer(nullptr, &tables, {});
  std::vector<PreparedPhoto> prepared(files.size());
  pool->ParallelFor(files.size(), [&](size_t i) {
    prepared[i] = preparer.Extract({files[i].name, files[i].path, {}}, set.camera);
  });
  std::vector<std::string> names;
  for (PreparedPhoto& photo : prepared) {
    if (photo.features.size() == 0) continue;
    names.push_back(photo.name);
    photos->features.push_back(std::move(photo.features));
    photos->seeds.push_back(photo.hash.Seed());
  }
  photos->neighbors.resize(photos->features.size());
  return names;
}

// Verifies pairs of the photos from `first` on, and notes those that hold.
Status Verify(const std::vector<Pair>& pairs, const CameraModel& camera, size_t first,
              ThreadPool* pool, Photos* photos) {
  const size_t count = photos->features.size() - first;
  std::vector<std::shared_ptr<const ImageFeatures>> images;
  for (uint32_t i = 0; i < count; ++i) {
    // Shared without owning: `photos` outlives them.
    const std::shared_ptr<const Features> features(std::shared_ptr<void>(),
                                                   &photos->features[first + i]);
    VEDUTA_ASSIGN_OR_RETURN(
        auto image, ImageFeatures::Make(ImageId(i + 1), camera, features, kMatchedCountMax));
    images.push_back(std::move(image));
  }
  std::vector<uint8_t> verified(pairs.size(), 0);
  const CityMap no_map;
  pool->ParallelFor(pairs.size(), [&](size_t i) {
    const auto [a, b] = pairs[i];
    verified[i] = VerifyPair(*images[b], *images[a], no_map, MixSeed(kSeed, i), {}).outcome ==
                  TwoViewOutcome::kVerified;
  });
  for (size_t i = 0; i < pairs.size(); ++i) {
    if (verified[i] == 0) continue;
    const auto a = static_cast<uint32_t>(first + pairs[i].first);
    const auto b = static_cast<uint32_t>(first + pairs[i].second);
    photos->neighbors[a].push_back(b);
    photos->neighbors[b].push_back(a);
  }
  return Status::Ok();
}

}  // namespace

Result<PhotoSet> ParsePhotoSet(const std::string& text) {
  const std::vector<std::string> parts = SplitAt(text, '@');
  if (parts.size() == 2 || parts.size() > 4) {
    return Status::InvalidArgument(text + ": FOLDER[@WIDTHxHEIGHT@PARAMS[@TRUTH]] expected");
  }
  PhotoSet set;
  set.folder = parts[0];
  if (parts.size() > 2) {
    VEDUTA_ASSIGN_OR_RETURN(set.camera, ParseCamera(parts[1], parts[2]));
  }
  if (parts.size() > 3) set.truth = parts[3];
  return set;
}

Result<Photos> LoadPhotos(const std::vector<PhotoSet>& sets, uint32_t near_count,
                          ThreadPool* pool) {
  Photos photos;
  for (const PhotoSet& set : sets) {
    const size_t first = photos.features.size();
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<std::string> names, Extract(set, pool, &photos));
    photos.set_ends.push_back(static_cast<uint32_t>(photos.features.size()));
    if (!set.camera) continue;
    std::vector<Pair> pairs = AllPairs(static_cast<uint32_t>(names.size()));
    if (!set.truth.empty()) {
      VEDUTA_ASSIGN_OR_RETURN(const orders::Truth truth, orders::ReadTruth(set.truth));
      pairs = NearPairs(names, truth, near_count);
    }
    VEDUTA_RETURN_IF_ERROR(Verify(pairs, *set.camera, first, pool, &photos));
  }
  for (std::vector<uint32_t>& neighbors : photos.neighbors)
    std::sort(neighbors.begin(), neighbors.end());
  return photos;
}

}  // namespace veduta::bench
