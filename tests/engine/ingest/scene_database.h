// SPDX-License-Identifier: Apache-2.0
#pragma once
// A synthetic scene (tests/engine/mapping/synthetic_scene.h) as a database in a temporary folder,
// for tests of the parts that adding a photo is made of. Nothing is rendered, so it takes
// milliseconds.

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/ingest/change_writer.h"
#include "engine/ingest/mapping_context.h"
#include "engine/journal/journal.h"
#include "engine/photo/image_features.h"
#include "engine/query/digest.h"
#include "engine/query/invariants.h"
#include "tests/engine/mapping/synthetic_scene.h"
#include "tests/storage/samples.h"

namespace veduta {

class SceneDatabase {
 public:
  // `disk` may be a faulty one; without one the operating system's is written to, without syncing.
  explicit SceneDatabase(const SceneOptions& options = {}, size_t thread_count = 1,
                         std::shared_ptr<rocksdb::FileSystem> disk = nullptr)
      : scene_(MakeScene(options)), pool_(thread_count), disk_(std::move(disk)) {
    Open(true);
    const auto transaction = database_->BeginTransaction();
    DatabaseState state;
    state.next_camera = 2;
    transaction->PutCamera({ImageCamera(), "scene", Model(), "the truth"});
    Note({0, 0, "veduta", "camera", {}, {}, "scene"}, &state, transaction.get());
    EXPECT_OK(transaction->Commit());
  }

  void Close() { database_.reset(); }
  void Open(bool create = false) {
    DatabaseOptions options;
    options.create = create;
    options.sync_wal = disk_ != nullptr;
    options.file_system = disk_;
    auto opened = Database::Open(folder_ / "db", options);
    ASSERT_OK(opened);
    database_ = std::move(*opened);
  }

  static CameraId ImageCamera() { return CameraId(1); }
  CameraModel Model() const {
    CameraModel model;
    model.width_px = SyntheticScene::kWidth;
    model.height_px = SyntheticScene::kHeight;
    model.fx = scene_.camera.fx;
    model.fy = scene_.camera.fy;
    model.cx = model.u0 = scene_.camera.cx;
    model.cy = model.v0 = scene_.camera.cy;
    return model;
  }

  // Puts the state with one more entry of the journal.
  static void Note(JournalRecord entry, DatabaseState* state, Transaction* transaction) {
    AppendJournal(std::move(entry), state, transaction);
    transaction->PutState(*state);
  }

  // Stores cameras [begin, end) of the scene as postponed images, ids from 1, with their features
  // and their pairs among each other and with those stored before.
  void AddImages(uint32_t begin, uint32_t end) {
    DatabaseState state = State();
    const auto transaction = database_->BeginTransaction();
    for (uint32_t k = begin; k < end; ++k) {
      ImageRecord record;
      record.id = scene_.images[k].id;
      record.name = "image" + std::to_string(k);
      const std::vector<uint8_t> bytes(record.name.begin(), record.name.end());
      record.photo = HashContent(bytes);
      record.camera = ImageCamera();
      record.width_px = SyntheticScene::kWidth;
      record.height_px = SyntheticScene::kHeight;
      record.size_bytes = bytes.size();
      record.feature_count = static_cast<uint32_t>(scene_.images[k].features->size());
      record.contributor = "anna";
      record.verdict = Verdict::kPostponed;
      record.reason = Reason::kNoGoodTriple;
      EXPECT_OK(database_->WritePhotoAhead(record.photo, bytes, *scene_.images[k].features));
      transaction->PutImage(record);
      AppendJournal({0, 0, "anna", "add", record.id, {}, ""}, &state, transaction.get());
      for (uint32_t j = 0; j < k; ++j) {
        if (j < begin && !IsStored(j)) continue;
        PairRecord pair = scene_.Pair(j, k);
        if (!pair.matches.empty()) transaction->PutPair(pair);
      }
      stored_.push_back(k);
      state.next_image = std::max(state.next_image, record.id.value + 1);
      ++state.retrievable_image_count;
    }
    transaction->PutState(state);
    EXPECT_OK(transaction->Commit());
  }

  // Stores the poses of these cameras and all points that two of them see as a reconstruction, in
  // the frame that `world_from_truth` gives. The next id is its id.
  ReconstructionId AddReconstruction(const std::vector<uint32_t>& cameras,
                                     const Sim3& world_from_truth = {}) {
    DatabaseState state = State();
    const ReconstructionId id(state.next_reconstruction++);
    const CityMap map = MapOf(cameras, id, world_from_truth);
    const auto transaction = database_->BeginTransaction();
    Placement placement;
    placement.verdict = Verdict::kFounded;
    placement.reconstruction = placement.founded = id;
    for (const auto& [image, unused] : map.images()) placement.placed.push_back(image);
    EXPECT_OK(WritePlacementChanges(map, *Snap(), placement, {}, transaction.get()));
    for (const ImageId image : placement.placed) {
      ImageRecord record = *Snap()->GetImage(image);
      record.verdict = Verdict::kFounded;
      record.reason = Reason::kGoodTriple;
      transaction->PutImage(record);
    }
    const std::string count = std::to_string(placement.placed.size()) + " images";
    Note({0, 0, "veduta", "adjust", {}, id, count}, &state, transaction.get());
    EXPECT_OK(transaction->Commit());
    return id;
  }

  // From now on each point is seen by cameras side by side alone, so many and one.
  void LimitTracks(uint32_t reach) { track_reach_ = reach; }

  // The cameras at their places, and the points that two of them see.
  CityMap MapOf(const std::vector<uint32_t>& cameras, ReconstructionId id,
                const Sim3& world_from_truth = {}) const {
    CityMap map;
    for (const uint32_t k : cameras) {
      MapImage image = scene_.images[k];
      image.reconstruction = id;
      image.cam_from_world = TransformCameraWorld(world_from_truth, scene_.poses[k]);
      map.PlaceImage(std::move(image));
    }
    for (uint32_t i = 0; i < scene_.points.size(); ++i) {
      std::vector<TrackElement> track;
      for (const uint32_t k : cameras) {
        const int feature = scene_.feature_of[k][i];
        const bool is_near = IsNear(i % cameras.size(), k);
        if (feature >= 0 && is_near)
          track.push_back({ImageId(k + 1), static_cast<FeatureIndex>(feature)});
      }
      if (track.size() >= 2)
        map.AddPoint(track.front().image, world_from_truth * scene_.points[i], track);
    }
    return map;
  }

  // Camera k as a photo at hand, and its verified matches with others; none of it needs be stored.
  std::shared_ptr<const ImageFeatures> Photo(uint32_t k, uint32_t matched_count_max = 1500) const {
    return *ImageFeatures::Make(scene_.images[k].id, Model(), scene_.images[k].features,
                                matched_count_max);
  }
  std::vector<PairMatches> MatchesOf(uint32_t k, const std::vector<uint32_t>& others) const {
    std::vector<PairMatches> matches;
    for (const uint32_t j : others) {
      const PairRecord pair = j < k ? scene_.Pair(j, k) : scene_.Pair(k, j);
      matches.push_back(MatchesFrom(pair, scene_.images[k].id));
    }
    return matches;
  }

  std::shared_ptr<const Snapshot> Snap() const { return database_->GetSnapshot(); }
  DatabaseState State() const { return *Snap()->GetState(); }
  const SyntheticScene& scene() const { return scene_; }
  Database* database() { return database_.get(); }
  ImageFeatureCache* features() { return &features_; }
  ThreadPool* pool() { return &pool_; }

 private:
  bool IsNear(size_t first, uint32_t k) const {
    return !track_reach_ || (k >= first && k <= first + *track_reach_);
  }
  bool IsStored(uint32_t k) const {
    return std::find(stored_.begin(), stored_.end(), k) != stored_.end();
  }

  SyntheticScene scene_;
  TemporaryFolder folder_;
  std::unique_ptr<Database> database_;
  ImageFeatureCache features_{64 << 20, 1500};
  ThreadPool pool_;
  std::shared_ptr<rocksdb::FileSystem> disk_;
  std::vector<uint32_t> stored_;
  std::optional<uint32_t> track_reach_;
};

// A loader, an empty map and default options over the newest snapshot of a scene's database.
struct SceneWork {
  explicit SceneWork(SceneDatabase* scene)
      : loader(scene->Snap(), scene->features(), &map),
        context{&loader, &map, scene->pool(), options} {}

  CityMap map;
  MapperOptions options;
  MapLoader loader;
  MappingContext context;
};

inline void ExpectSound(const SceneDatabase& scene) {
  const auto violations = FindViolations(*scene.Snap(), 9);
  ASSERT_OK(violations);
  for (const std::string& violation : *violations) ADD_FAILURE() << violation;
}

inline std::string DigestHex(const SceneDatabase& scene) {
  const auto digest = DigestOf(*scene.Snap());
  EXPECT_OK(digest);
  return digest.ok() ? digest->Hex() : "";
}

// The true rotation between two placed images is found, whatever the frame.
inline double RelativeRotationErrorDeg(const CityMap& map, const SyntheticScene& scene, uint32_t i,
                                       uint32_t j) {
  const Rigid3 found =
      map.image(ImageId(j + 1)).cam_from_world * map.image(ImageId(i + 1)).cam_from_world.Inverse();
  return RotationErrorDeg(found, scene.poses[j] * scene.poses[i].Inverse());
}

// A frame that is not the truth's.
inline Sim3 AnotherFrame() {
  return {0.5,
          Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized())),
          {4, 5, 6}};
}

}  // namespace veduta
