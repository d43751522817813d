// SPDX-License-Identifier: Apache-2.0
#include "engine/engine.h"

#include <condition_variable>
#include <thread>

#include "engine/journal/journal.h"

namespace veduta {

// Prepares a window of photos ahead of the one being applied. Whoever waits for a photo helps.
class Engine::Lookahead {
 public:
  Lookahead(const PhotoPreparer& preparer, std::span<const PhotoSubmission> photos,
            std::span<const CameraRecord> cameras, ThreadPool* pool)
      : preparer_(preparer),
        photos_(photos),
        cameras_(cameras),
        pool_(pool),
        window_(2 * pool->thread_count() + 1),
        slots_(photos.size()) {}
  ~Lookahead() {
    std::unique_lock lock(mutex_);
    started_ = slots_.size();  // start no more
    changed_.wait(lock, [this] { return running_ == 0; });
  }

  Result<PreparedPhoto> Take(size_t i) {
    std::unique_lock lock(mutex_);
    limit_ = std::min(slots_.size(), i + window_);
    const size_t fresh = limit_ - std::min(limit_, offered_);
    offered_ = std::max(offered_, limit_);
    lock.unlock();
    for (size_t k = 0; k < fresh && pool_->thread_count() > 0; ++k) {
      {
        const std::lock_guard guard(mutex_);
        ++running_;
      }
      pool_->Submit([this] {
        PrepareNext();
        const std::lock_guard guard(mutex_);
        --running_;
        changed_.notify_all();
      });
    }
    lock.lock();
    while (!slots_[i]) {
      lock.unlock();
      const bool helped = PrepareNext();
      lock.lock();
      if (!helped && !slots_[i]) changed_.wait(lock, [&] { return slots_[i].has_value(); });
    }
    Result<PreparedPhoto> taken = std::move(*slots_[i]);
    slots_[i] = Status::Cancelled("taken");  // frees the features
    return taken;
  }

 private:
  bool PrepareNext() {
    std::unique_lock lock(mutex_);
    if (started_ >= limit_) return false;
    const size_t i = started_++;
    lock.unlock();
    Result<PreparedPhoto> prepared = preparer_.Prepare(photos_[i].photo, cameras_[i].model);
    lock.lock();
    slots_[i] = std::move(prepared);
    changed_.notify_all();
    return true;
  }

  const PhotoPreparer& preparer_;
  const std::span<const PhotoSubmission> photos_;
  const std::span<const CameraRecord> cameras_;
  ThreadPool* const pool_;
  const size_t window_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::optional<Result<PreparedPhoto>>> slots_;
  size_t started_ = 0, limit_ = 0, offered_ = 0, running_ = 0;
};

Result<std::unique_ptr<Engine>> Engine::Open(const std::string& path, EngineOptions options) {
  std::unique_ptr<Engine> engine(new Engine);
  if (options.thread_count == 0)
    options.thread_count = std::max(1u, std::thread::hardware_concurrency());
  engine->options_ = options;
  VEDUTA_ASSIGN_OR_RETURN(engine->database_, Database::Open(path, options.database));
  engine->tables_ = std::make_unique<UndistortCache>(options.undistort_cache_bytes);
  engine->preparer_ = std::make_unique<PhotoPreparer>(engine->database_.get(),
                                                      engine->tables_.get(), options.prepare);
  engine->retrieval_ = std::make_unique<Retrieval>(options.ingest.retrieval);
  engine->features_ = std::make_unique<ImageFeatureCache>(options.ingest.feature_cache_bytes,
                                                          options.ingest.matched_count_max);
  engine->pool_ = std::make_unique<ThreadPool>(options.thread_count - 1);
  engine->ingest_ =
      std::make_unique<Ingest>(engine->database_.get(), engine->retrieval_.get(),
                               engine->features_.get(), engine->pool_.get(), options.ingest);
  return engine;
}

Engine::~Engine() = default;

Result<CameraRecord> Engine::FindCamera(const std::string& name) const {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<CameraRecord> cameras,
                          database_->GetSnapshot()->ListCameras());
  std::string known;
  for (const CameraRecord& camera : cameras) {
    if (camera.name == name) return camera;
    known += (known.empty() ? "" : ", ") + camera.name;
  }
  return Status::NotFound(
      "there is no camera '" + name + "'; " +
      (known.empty() ? "add one with `veduta camera add`" : "the database has: " + known));
}

Result<CameraId> Engine::AddCamera(const std::string& name, const CameraModel& model,
                                   const std::string& source) {
  const std::lock_guard lock(writer_);
  if (name.empty()) return Status::InvalidArgument("a camera needs a name");
  const Result<CameraRecord> known = FindCamera(name);
  if (known.ok()) {
    if (known->model == model) return known->id;
    return Status::AlreadyExists(
        "camera '" + name +
        "' exists with other intrinsics; photos rely on it, so give the new one another name");
  }
  if (known.status().code() != StatusCode::kNotFound) return known.status();
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, database_->GetSnapshot()->GetState());
  const std::unique_ptr<Transaction> transaction = database_->BeginTransaction();
  const CameraId id(state.next_camera++);
  transaction->PutCamera({id, name, model, source});
  JournalRecord entry;
  entry.actor = "veduta";
  entry.action = "camera";
  entry.detail = name;
  AppendJournal(std::move(entry), &state, transaction.get());
  transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(transaction->Commit());
  return id;
}

Status Engine::AddPhotos(std::span<const PhotoSubmission> photos,
                         const std::function<void(const AddOutcome&)>& report,
                         std::stop_token stop) {
  const std::lock_guard lock(writer_);
  while (const std::optional<FollowUp> step = ingest_->RunNextStep())  // left by an earlier process
    VEDUTA_RETURN_IF_ERROR(step->status);
  std::vector<CameraRecord> cameras;
  for (const PhotoSubmission& photo : photos) {
    VEDUTA_ASSIGN_OR_RETURN(CameraRecord camera, FindCamera(photo.camera));
    cameras.push_back(std::move(camera));
  }
  Lookahead lookahead(*preparer_, photos, cameras, pool_.get());
  for (size_t i = 0; i < photos.size(); ++i) {
    if (stop.stop_requested()) {
      return Status::Cancelled("stopped after " + std::to_string(i) + " of " +
                               std::to_string(photos.size()) +
                               " photos; run the same command again to go on");
    }
    VEDUTA_ASSIGN_OR_RETURN(PreparedPhoto photo, lookahead.Take(i));
    VEDUTA_ASSIGN_OR_RETURN(AddOutcome outcome,
                            ingest_->Apply(std::move(photo), cameras[i], photos[i].contributor));
    Stopwatch watch;
    while (const std::optional<FollowUp> step = ingest_->RunNextStep()) {
      VEDUTA_RETURN_IF_ERROR(step->status);
      outcome.propagated.insert(outcome.propagated.end(), step->placed.begin(), step->placed.end());
    }
    outcome.times.follow_ms = watch.LapMs();
    outcome.times.total_ms += outcome.times.follow_ms;
    report(outcome);
  }
  return Status::Ok();
}

Result<std::vector<RankedImage>> Engine::RankPhoto(const PhotoSource& photo,
                                                   const std::optional<CameraModel>& camera,
                                                   uint32_t count_max) const {
  const PreparedPhoto prepared = preparer_->Extract(photo, camera);
  if (prepared.reason != Reason::kNone)
    return Status::InvalidArgument(photo.path + ": " + prepared.detail);
  return Ask().RankFeatures(prepared.features, count_max, pool_.get());
}

Status Engine::TrainVocabulary() {
  const std::lock_guard lock(writer_);
  return retrieval_->Train(database_.get(), pool_.get());
}

Status Engine::ImportVocabulary(const VocabularyTree& tree) {
  const std::lock_guard lock(writer_);
  return retrieval_->Import(database_.get(), tree, pool_.get());
}

}  // namespace veduta
