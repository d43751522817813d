// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos with their features, and which pairs of them show the same.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "storage/base/status.h"
#include "storage/base/thread_pool.h"
#include "storage/model/camera.h"
#include "storage/model/features.h"

namespace veduta::bench {

// A folder of photos that one camera took. Without a camera its photos are only there to be
// mistaken for others.
struct PhotoSet {
  std::string folder;
  std::optional<CameraModel> camera;
  // A folder of files NAME.camera. With it only photos that were taken close to each other are
  // compared, and without it all.
  std::string truth;
};

// "FOLDER", "FOLDER@WIDTHxHEIGHT@fx,fy,cx,cy[,...]", or the same with "@TRUTH" behind it.
Result<PhotoSet> ParsePhotoSet(const std::string& text);

struct Photos {
  std::vector<Features> features;
  std::vector<uint64_t> seeds;     // of the photos' bytes
  std::vector<uint32_t> set_ends;  // one past the last photo of each set
  // neighbors[i]: indices of the photos with which photo i is verified, ascending.
  std::vector<std::vector<uint32_t>> neighbors;
};

// Features as ingestion extracts them, and pairs as it verifies them where it has no map. Photos
// without features are left out. `near_count`: photos of a set with truth that each is compared
// with, those whose centres are nearest.
Result<Photos> LoadPhotos(const std::vector<PhotoSet>& sets, uint32_t near_count, ThreadPool* pool);

}  // namespace veduta::bench
