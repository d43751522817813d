// SPDX-License-Identifier: Apache-2.0
#pragma once
// Records with every field set, and a folder that goes away, for the tests of storage/.

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "storage/base/content_hash.h"
#include "storage/database.h"
#include "storage/model/features.h"
#include "storage/model/image.h"
#include "storage/model/pair.h"
#include "storage/model/points.h"
#include "storage/model/reconstruction.h"
#include "storage/model/state.h"
#include "storage/model/verdict.h"

// A Status or Result that must be Ok; prints why it is not.
inline testing::AssertionResult IsOk(const veduta::Status& status) {
  if (status.ok()) return testing::AssertionSuccess();
  return testing::AssertionFailure() << status.message();
}
template <typename T>
testing::AssertionResult IsOk(const veduta::Result<T>& result) {
  return IsOk(result.status());
}
#define ASSERT_OK(expression) ASSERT_TRUE(IsOk(expression))
#define EXPECT_OK(expression) EXPECT_TRUE(IsOk(expression))

namespace veduta {

class TemporaryFolder final {
 public:
  TemporaryFolder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "veduta_test_XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) ADD_FAILURE() << "no temporary folder at " << pattern;
    path_ = pattern;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

inline std::vector<uint8_t> SampleBytes(uint64_t seed, size_t size) {
  SeededRandom random(seed);
  std::vector<uint8_t> bytes(size);
  for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(random.Next());
  return bytes;
}

inline ContentHash SampleHash(uint64_t seed) {
  return HashContent(SampleBytes(seed, 8));
}

inline Rigid3 SampleRigid(SeededRandom* random) {
  Rigid3 rigid;
  rigid.rotation =
      Eigen::Quaterniond(random->Unit() + 0.1, random->Unit(), random->Unit(), random->Unit())
          .normalized();
  rigid.translation = {random->Unit() * 10, -random->Unit(), random->Unit()};
  return rigid;
}

inline Features SampleFeatures(uint64_t seed, size_t count) {
  SeededRandom random(seed);
  Features features;
  for (size_t i = 0; i < count; ++i) {
    Keypoint k;
    k.x_px = static_cast<float>(random.Unit() * 4000);
    k.y_px = static_cast<float>(random.Unit() * 3000);
    k.scale_px = static_cast<float>(random.Unit() * 30);
    k.angle_deg = static_cast<float>(random.Unit() * 360);
    k.response = static_cast<float>(random.Unit());
    k.contrast_sign = random.Below(2) == 0 ? -1 : 1;
    k.rgb = {static_cast<uint8_t>(random.Next()), static_cast<uint8_t>(random.Next()),
             static_cast<uint8_t>(random.Next())};
    features.keypoints.push_back(k);
  }
  features.descriptors = SampleBytes(seed + 1, count * kDescriptorSize);
  return features;
}

inline ImageRecord SampleImage(uint32_t id) {
  ImageRecord image;
  image.id = ImageId(id);
  image.name = "street/" + std::to_string(id) + ".jpg";
  image.photo = SampleHash(id);
  image.camera = CameraId(1);
  image.width_px = 1536;
  image.height_px = 1024;
  image.size_bytes = 345678 + id;
  image.feature_count = 4200;
  image.contributor = "anna";
  image.time_unix_s = 1'700'000'000 + id;
  image.verdict = Verdict::kPlaced;
  image.reason = Reason::kRegistered;
  image.detail = "63 of 80 points";
  return image;
}

inline PairRecord SamplePair(uint32_t a, uint32_t b, size_t match_count) {
  SeededRandom random(MixSeed(a, b));
  PairRecord pair;
  pair.a = ImageId(a);
  pair.b = ImageId(b);
  pair.geometry = PairGeometry::kPlanar;
  pair.b_from_a = SampleRigid(&random);
  for (uint32_t i = 0; i < match_count; ++i) pair.matches.push_back({2 * i, 3 * i + 1});
  pair.lens_a.focal_px = 1000 + a;
  pair.lens_b.focal_px = 800;
  pair.lens_a.k1 = -0.125, pair.lens_a.k2 = 0.25;
  pair.lens_b.k1 = 0.5;
  return pair;
}

inline PointBlock SampleBlock(uint32_t home, size_t point_count) {
  SeededRandom random(home);
  PointBlock block;
  block.home = ImageId(home);
  for (uint32_t i = 0; i < point_count; ++i) {
    PointRecord point;
    point.id = {ImageId(home), 2 * i + 1};
    point.position = {random.Unit(), -random.Unit() * 1e3, random.Unit() * 1e-3};
    point.rgb = {static_cast<uint8_t>(i), 2, 255};
    point.error_px = static_cast<float>(random.Unit());
    for (uint32_t t = 0; t < 2 + i % 5; ++t)
      point.track.push_back({ImageId(home + 3 * t), random.Below(9000)});
    block.points.push_back(point);
  }
  block.next_ordinal = static_cast<uint32_t>(2 * point_count + 1);
  return block;
}

inline ReconstructionRecord SampleReconstruction(uint32_t id, uint32_t generation) {
  SeededRandom random(id);
  ReconstructionRecord record;
  record.id = ReconstructionId(id);
  record.merged_into = ReconstructionId(id + 1);
  const Rigid3 rigid = SampleRigid(&random);
  record.merged_from_this = {2.5, rigid.rotation, rigid.translation};
  record.image_count = 12;
  record.point_count = 5'000'000'000;
  record.observation_count = 6'000'000'000;
  record.reprojection_error_px_sum = 1234.5;
  record.geometry_version = 77;
  record.points_generation = generation;
  record.images_at_adjustment = 9;
  return record;
}

// Everything in `state` that tests change, with the counters moved on.
inline DatabaseState SampleState(uint32_t next_image) {
  DatabaseState state;
  state.next_image = next_image;
  state.next_journal = next_image + 1'000'000'000'000ull;
  state.images_at_vocabulary = 7;
  state.vocabulary_imported = true;
  state.retrievable_image_count = 5;
  state.pending_propagation = {ImageId(3), ImageId(1), ImageId(4)};
  return state;
}

inline std::unique_ptr<Database> MustOpen(const std::string& path, DatabaseOptions options) {
  auto opened = Database::Open(path, options);
  EXPECT_TRUE(opened.ok()) << opened.status().message();
  return opened.ok() ? std::move(*opened) : nullptr;
}
inline std::unique_ptr<Database> MustCreate(const std::string& path, DatabaseOptions options = {}) {
  options.create = true;
  return MustOpen(path, options);
}

}  // namespace veduta
