// SPDX-License-Identifier: Apache-2.0
#pragma once
// The database of a city's photographs: one handle that many threads share. One adds at a time
// (others that want to add wait); any number ask meanwhile, each on a snapshot that does not change
// under them.

#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "engine/ingest/ingest.h"
#include "engine/query/queries.h"
#include "storage/base/stopwatch.h"

namespace veduta {

struct EngineOptions {
  DatabaseOptions database;
  uint32_t thread_count = 0;  // 0: one a core
  PrepareOptions prepare;
  IngestOptions ingest;
  size_t undistort_cache_bytes = 256ull << 20;
};

class Engine final {
 public:
  static Result<std::unique_ptr<Engine>> Open(const std::string& path, EngineOptions options);
  ~Engine();

  // kAlreadyExists when the name is in use by another model, or was with other intrinsics; the same
  // again is a no-op.
  Result<CameraId> AddCamera(const std::string& name, const CameraModel& model,
                             const std::string& source);
  Result<CameraRecord> FindCamera(const std::string& name) const;

  // Adds the photos in their order; preparation runs ahead on all threads. `report` is called once
  // a photo, in order, after its commit and all that followed from it. A stop request finishes the
  // photo at hand: kCancelled. Any other error means that the photos not reported are not stored.
  Status AddPhotos(std::span<const PhotoSubmission> photos,
                   const std::function<void(const AddOutcome&)>& report, std::stop_token stop = {});

  Queries Ask() const {
    return Queries(database_->GetSnapshot(), retrieval_.get(), features_.get());
  }
  // Ranked candidates for a photo that is not added; `camera` undistorts it where given.
  Result<std::vector<RankedImage>> RankPhoto(const PhotoSource& photo,
                                             const std::optional<CameraModel>& camera,
                                             uint32_t count_max) const;

  Status TrainVocabulary();
  Status ImportVocabulary(const VocabularyTree& tree);
  Retrieval* retrieval() const { return retrieval_.get(); }
  Database* database() const { return database_.get(); }
  ThreadPool* pool() const { return pool_.get(); }

 private:
  Engine() = default;
  class Lookahead;

  EngineOptions options_;
  std::unique_ptr<Database> database_;
  std::unique_ptr<UndistortCache> tables_;
  std::unique_ptr<PhotoPreparer> preparer_;
  std::unique_ptr<Retrieval> retrieval_;
  std::unique_ptr<ImageFeatureCache> features_;
  std::unique_ptr<ThreadPool> pool_;  // before what uses it is gone
  std::unique_ptr<Ingest> ingest_;
  std::mutex writer_;
};

}  // namespace veduta
