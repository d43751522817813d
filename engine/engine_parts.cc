// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>
#include <thread>
#include <utility>

#include "engine/camera/sandbox/sandboxed_decoder.h"
#include "engine/journal/camera_entry.h"
#include "engine/parts.h"
#include "engine/query/city_answers.h"
#include "engine/unnamed_camera.h"
#include "storage/base/memory_shortage.h"
#include "storage/base/option_bounds.h"
#include "storage/base/stopwatch.h"

namespace veduta {
namespace {

// Far above any machine of today; a bound for mistaken input.
constexpr uint32_t kThreadCountMax = 1024;

}  // namespace

Status EngineOptions::Check() const {
  if (create && read_only) {
    return Status::InvalidArgument("create and read_only exclude each other");
  }
  return OptionBounds()
      .Between("thread_count", thread_count, 0, kThreadCountMax)
      .AtLeast("block_cache_bytes", static_cast<double>(block_cache_bytes), 1)
      .AtLeast("feature_cache_bytes", static_cast<double>(feature_cache_bytes), 1)
      .AtLeast("undistort_cache_bytes", static_cast<double>(undistort_cache_bytes), 1)
      .AtLeast("surface_cache_bytes", static_cast<double>(surface_cache_bytes), 3)
      .status();
}

Status RepairRequest::Check() const {
  return OptionBounds().Between("thread_count", thread_count, 0, kThreadCountMax).status();
}

Status EngineTuning::Check() const {
  return OptionBounds()
      .Part("database", database.Check())
      .Part("prepare", prepare.Check())
      .Part("ingest", ingest.Check())
      .status();
}

Result<std::unique_ptr<Engine>> EngineParts::Open(const std::string& path,
                                                  const EngineOptions& options,
                                                  EngineTuning tuning) {
  VEDUTA_RETURN_IF_ERROR(OptionBounds().Part("options", options.Check()).status());
  tuning.database.create = options.create;
  tuning.database.read_only = options.read_only;
  tuning.database.sync_wal = options.sync;
  tuning.database.block_cache_bytes = options.block_cache_bytes;
  tuning.ingest.feature_cache_bytes = options.feature_cache_bytes;
  if (options.prepare_memory_bytes != 0) {
    tuning.prepare.memory_bytes = options.prepare_memory_bytes;
  } else {
    tuning.prepare.memory_bytes = DefaultPrepareMemoryBytes(
        UsableMemoryBytes(),
        options.block_cache_bytes + options.feature_cache_bytes + options.undistort_cache_bytes);
  }
  VEDUTA_RETURN_IF_ERROR(OptionBounds().Part("options", tuning.Check()).status());
  if (!options.decoder_program.empty() && !tuning.decoder) {
    VEDUTA_ASSIGN_OR_RETURN(tuning.decoder, SandboxedDecoder::Start(options.decoder_program));
  }

  auto parts = std::make_shared<EngineParts>();
  parts->path = path;
  parts->options = options;
  if (options.thread_count == 0) {
    parts->options.thread_count = std::max(1u, std::thread::hardware_concurrency());
  }
  parts->tuning = tuning;
  VEDUTA_ASSIGN_OR_RETURN(parts->database, Database::Open(path, tuning.database));
  if (!options.read_only) VEDUTA_RETURN_IF_ERROR(parts->DropBackupLinks());
  parts->tables = std::make_unique<UndistortCache>(options.undistort_cache_bytes);
  parts->preparer =
      std::make_unique<PhotoPreparer>(parts->database.get(), parts->tables.get(), tuning.prepare,
                                      tuning.decoder ? *tuning.decoder : DecoderInProcess());
  parts->pool = std::make_unique<ThreadPool>(parts->options.thread_count - 1);
  parts->writer = std::make_unique<Writer>(parts->database.get());
  parts->RenewCaches();
  EngineParts* const raw = parts.get();
  const CameraFinder cameras{[raw](const PhotoSource& photo) {
                               return CatchShortage("find the photo's camera",
                                                    [&] { return FindUnnamedCamera(raw, photo); });
                             },
                             [raw](const PhotoSource& photo) {
                               return CatchShortage("estimate the photo's camera", [&] {
                                 return EstimateUnnamedCamera(raw, photo);
                               });
                             }};
  std::unique_ptr<PhotoBlurrer> blurrer;
  if (!options.blur_command.empty()) {
    blurrer = std::make_unique<PhotoBlurrer>(options.blur_command, parts->preparer.get(),
                                             parts->database.get());
  }
  parts->scheduler = std::make_unique<Scheduler>(
      parts->writer.get(), parts->preparer.get(), &parts->ingest, parts->pool.get(), cameras,
      [raw](const DueStep& step) { return raw->DoLongStep(step); }, options.settle_each,
      std::move(blurrer));
  std::unique_ptr<Engine> engine(new Engine);
  engine->parts_ = std::move(parts);
  return engine;
}

EngineParts& EngineParts::Of(const Questions& questions) {
  return *questions.view_->parts;
}

const std::shared_ptr<const Snapshot>& EngineParts::SnapshotOf(const Questions& questions) {
  return questions.view_->snapshot;
}

Result<CameraRecord> EngineParts::FindCamera(const std::string& name) {
  const std::shared_ptr<const Snapshot> snapshot = database->GetSnapshot();
  CameraId known;
  {
    const std::lock_guard lock(caches_mutex);
    if (const auto found = cameras.find(name); found != cameras.end()) known = found->second;
  }
  if (known.valid()) return snapshot->GetCamera(known);
  VEDUTA_ASSIGN_OR_RETURN(CameraRecord camera, veduta::FindCamera(*snapshot, name));
  const std::lock_guard lock(caches_mutex);
  cameras[name] = camera.id;
  return camera;
}

Result<std::optional<CameraRecord>> EngineParts::FindNamed(const std::string& name) {
  if (name.empty()) return std::optional<CameraRecord>();
  VEDUTA_ASSIGN_OR_RETURN(CameraRecord camera, FindCamera(name));
  return std::optional(std::move(camera));
}

Result<CameraId> EngineParts::AddCamera(CameraRecord camera) {
  if (camera.name.empty()) return Status::InvalidArgument("a camera needs a name");
  Writer::Turn turn = writer->Take();
  const std::unique_ptr<Transaction> transaction = turn.database().BeginTransaction();
  const std::shared_ptr<const Snapshot> snapshot = transaction->base();
  const Result<CameraRecord> known = veduta::FindCamera(*snapshot, camera.name);
  if (known.ok()) {
    if (known->model == camera.model) return known->id;
    return Status::AlreadyExists(
        "camera '" + camera.name +
        "' exists with other intrinsics; photos rely on it, so give the new one another name");
  }
  if (known.status().code() != StatusCode::kNotFound) return known.status();
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, snapshot->GetState());
  camera.id = CameraId(state.next_camera++);
  PutNewCamera(camera, &state, transaction.get());
  transaction->PutState(state);
  VEDUTA_RETURN_IF_ERROR(transaction->Commit());
  return camera.id;
}

std::shared_ptr<EngineCaches> EngineParts::GetCaches() {
  const std::lock_guard lock(caches_mutex);
  return caches;
}

void EngineParts::RenewCaches() {
  auto renewed =
      std::make_shared<EngineCaches>(tuning.ingest, preparing_vocabulary, preparer->decoder(),
                                     options.surface_cache_bytes / kCoarseShare);
  ingest =
      std::make_unique<Ingest>(database.get(), &renewed->retrieval, &renewed->features, pool.get(),
                               tuning.ingest, options.doubles, preparer->decoder());
  const std::lock_guard lock(caches_mutex);
  caches = std::move(renewed);
  cameras.clear();
}

Status EngineParts::Reopen(Writer::Turn* turn) {
  VEDUTA_RETURN_IF_ERROR(turn->database().Reopen());
  RenewCaches();
  return Status::Ok();
}

// A vocabulary is prepared without a turn of the writer, and Reopen deletes what is prepared: a
// commit may not name it then.
Status EngineParts::Activate(const std::shared_ptr<EngineCaches>& from,
                             Retrieval::Prepared prepared, double* turn_ms) {
  Writer::Turn turn = writer->Take();
  if (GetCaches() != from) {
    return Status::Busy("the database was opened again while a vocabulary was prepared: try again");
  }
  Stopwatch watch;
  const Status activated = from->retrieval.Activate(&turn.database(), std::move(prepared));
  if (turn_ms != nullptr) *turn_ms = watch.LapMs();
  return activated;
}

Result<std::optional<FollowUp>> EngineParts::DoLongStep(const DueStep& step) {
  return step.kind == FollowUpKind::kVocabulary ? TrainIfDue() : AdjustLarge(step.reconstruction);
}

Result<std::optional<FollowUp>> EngineParts::TrainIfDue() {
  const std::shared_ptr<EngineCaches> from = GetCaches();
  // The descriptors that a vocabulary is trained from take as much memory. Reading what is kept
  // again takes about a second.
  from->features.Clear();
  const auto train = [&]() -> Result<std::optional<FollowUp>> {
    VEDUTA_ASSIGN_OR_RETURN(std::optional<Retrieval::Prepared> prepared,
                            from->retrieval.TrainIfDue(database.get(), pool.get()));
    if (!prepared) return std::optional<FollowUp>();
    FollowUp trained;
    trained.kind = FollowUpKind::kVocabulary;
    VEDUTA_RETURN_IF_ERROR(Activate(from, std::move(*prepared), &trained.turn_ms));
    return std::optional(std::move(trained));
  };
  Result<std::optional<FollowUp>> trained = train();
  if (!trained.ok() && GetCaches() != from) return std::optional<FollowUp>();
  return trained;
}

Result<std::optional<FollowUp>> EngineParts::AdjustLarge(ReconstructionId reconstruction) {
  const std::shared_ptr<EngineCaches> from = GetCaches();
  LargeAdjustment adjustment(
      {database.get(), &from->retrieval, &from->features, pool.get(), tuning.ingest, nullptr},
      reconstruction);
  const Status computed = adjustment.Compute();
  Writer::Turn turn = writer->Take();
  if (GetCaches() != from) return std::optional<FollowUp>();  // opened again meanwhile
  VEDUTA_RETURN_IF_ERROR(computed);
  Stopwatch watch;
  FollowUp adjusted = ingest->Commit(&adjustment, reconstruction);
  adjusted.turn_ms = watch.LapMs();
  return std::optional(std::move(adjusted));
}

}  // namespace veduta
