// SPDX-License-Identifier: Apache-2.0
// Goal: a city of which only a small part is in memory grows as one that is in memory whole: every
//   step loads what it touches, none aborts or is set aside, and the digest is the same.
// Method: photos along a facade, made of descriptors without rendering. Stretches of it come first
//   and the gaps between them afterwards, so that reconstructions are merged over and over. Each
//   photo is compared with a few others only, as in a large city: what it is compared with is
//   loaded for that alone. The map is forgotten after every photo, after some, and never.
#include <gtest/gtest.h>

#include "engine/ingest/ingest.h"
#include "engine/query/digest.h"
#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

constexpr uint32_t kPhotoCount = 90;
constexpr double kSpacing = 2, kDepth = 8;  // metres
constexpr uint32_t kStretch = 9;  // photos of a stretch, and of a gap; no view reaches over one

struct Facade {
  std::vector<Eigen::Vector3d> points;
  std::vector<uint8_t> descriptors;
};

Facade MakeFacade() {
  Facade facade;
  SeededRandom random(5);
  const double length = kPhotoCount * kSpacing + 2 * kDepth;
  for (int i = 0; i < static_cast<int>(20 * length); ++i) {
    facade.points.push_back(
        {length * random.Unit() - kDepth, 5 * random.Unit() - 2.5, kDepth + 3 * random.Unit()});
    for (int byte = 0; byte < kDescriptorSize; ++byte)
      facade.descriptors.push_back(static_cast<uint8_t>(random.Below(90)));
  }
  return facade;
}

// Every fourth photo is taken from further back, and its points lead far along the facade.
Rigid3 PoseOf(uint32_t k) {
  Rigid3 pose;
  pose.translation = {-kSpacing * k, 0.2 * std::sin(k), k % 4 == 3 ? 12.0 : 0.0};
  return pose;
}

PreparedPhoto TakePhoto(const Facade& facade, uint32_t k, const Pinhole& camera) {
  PreparedPhoto photo;
  photo.name = "photo" + std::to_string(k);
  const std::vector<uint8_t> bytes(photo.name.begin(), photo.name.end());
  photo.hash = HashContent(bytes);
  photo.size_bytes = bytes.size();
  photo.width_px = SyntheticScene::kWidth;
  photo.height_px = SyntheticScene::kHeight;
  SeededRandom random(photo.hash.Seed());
  for (size_t i = 0; i < facade.points.size(); ++i) {
    const Eigen::Vector3d x_cam = PoseOf(k) * facade.points[i];
    const Eigen::Vector2d x =
        camera.Project(x_cam) + 0.3 * Eigen::Vector2d{Gaussian(random), Gaussian(random)};
    if (x.x() < 0 || x.y() < 0 || x.x() >= photo.width_px || x.y() >= photo.height_px) continue;
    Keypoint keypoint;
    keypoint.x_px = static_cast<float>(x.x());
    keypoint.y_px = static_cast<float>(x.y());
    keypoint.scale_px = static_cast<float>(20 / x_cam.z());
    keypoint.contrast_sign = i % 2 ? 1 : -1;
    photo.features.keypoints.push_back(keypoint);
    const auto descriptor = facade.descriptors.begin() + static_cast<long>(i) * kDescriptorSize;
    photo.features.descriptors.insert(photo.features.descriptors.end(), descriptor,
                                      descriptor + kDescriptorSize);
  }
  return photo;
}

// Every other stretch, and then the gaps.
std::vector<uint32_t> Order() {
  std::vector<uint32_t> order;
  for (const uint32_t parity : {0u, 1u}) {
    for (uint32_t k = 0; k < kPhotoCount; ++k) {
      if (k / kStretch % 2 == parity) order.push_back(k);
    }
  }
  return order;
}

void Train(SceneDatabase* scene, Retrieval* retrieval) {
  auto trained = retrieval->TrainIfDue(scene->database(), scene->pool());
  ASSERT_OK(trained);
  ASSERT_TRUE(trained->has_value());
  ASSERT_OK(retrieval->Activate(scene->database(), std::move(**trained)));
}

struct Grown {
  std::string digest;
  size_t merges = 0, reconstructions = 0, placed = 0, violations = 0;
};

Grown Grow(uint32_t map_images_max) {
  SceneDatabase scene;  // its camera and its parts; its images are not added
  const Facade facade = MakeFacade();
  IngestOptions options;
  options.map_images_max = map_images_max;
  options.retrieval.compare_all_max = 12;
  options.retrieval.candidate_count_min = 3;
  options.neighbors.extended_count_max = 2;
  Retrieval retrieval(options.retrieval);
  Ingest ingest(scene.database(), &retrieval, scene.features(), scene.pool(), options);
  const CameraRecord camera = *scene.Snap()->GetCamera(SceneDatabase::ImageCamera());
  Grown grown;
  for (const uint32_t k : Order()) {
    PreparedPhoto photo = TakePhoto(facade, k, scene.scene().camera);
    const std::vector<uint8_t> bytes(photo.name.begin(), photo.name.end());
    EXPECT_OK(scene.database()->WritePhotoAhead(photo.hash, bytes, photo.features));
    const auto outcome = ingest.Apply(std::move(photo), camera, "anna");
    EXPECT_OK(outcome);
    if (outcome.ok()) grown.merges += outcome->verdict == Verdict::kMerged;
    while (const auto step = ingest.RunNextStep()) EXPECT_OK(step->status);
    LongSteps long_steps;
    EXPECT_FALSE(ingest.RunNextStep(&long_steps).has_value());
    if (long_steps.next) Train(&scene, &retrieval);
  }
  const auto snapshot = scene.Snap();
  for (const ReconstructionRecord& record : *snapshot->ListReconstructions()) {
    grown.reconstructions += record.is_living();
    grown.placed += record.image_count;
  }
  grown.violations = FindViolations(*snapshot, 9)->size();
  grown.digest = DigestOf(*snapshot)->Hex();
  return grown;
}

TEST(LongFacade, GrowsTheSameWhateverIsInMemory) {
  const Grown whole = Grow(2 * kPhotoCount);
  EXPECT_GE(whole.merges, 4u) << "too little is merged for this test to mean anything";
  EXPECT_EQ(whole.reconstructions, 1u);
  EXPECT_GE(whole.placed, kPhotoCount - 2);
  EXPECT_EQ(whole.violations, 0u);
  for (const uint32_t map_images_max : {1u, 25u}) {
    SCOPED_TRACE(std::to_string(map_images_max) + " images are kept in memory");
    EXPECT_EQ(Grow(map_images_max).digest, whole.digest);
  }
}

}  // namespace
}  // namespace veduta
