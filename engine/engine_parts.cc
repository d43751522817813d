// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>
#include <thread>
#include <utility>

#include "engine/parts.h"
#include "engine/query/city_answers.h"

namespace veduta {
namespace {

constexpr uint32_t kThreadCountMax = 1024;  // far above any machine; a bound for mistaken input

Status Named(const char* where, const Status& status) {
  if (status.ok()) return status;
  return Status(status.code(), std::string(where) + "." + status.message());
}

}  // namespace

Status EngineOptions::Check() const {
  const auto broken = [](const char* field, uint64_t value, const char* rule) {
    return Status::InvalidArgument(std::string(field) + " is " + std::to_string(value) +
                                   ", but must be " + rule);
  };
  if (create && read_only) {
    return Status::InvalidArgument("create and read_only exclude each other");
  }
  if (thread_count > kThreadCountMax) return broken("thread_count", thread_count, "1024 or less");
  if (block_cache_bytes < 1) return broken("block_cache_bytes", 0, "1 or more");
  if (feature_cache_bytes < 1) return broken("feature_cache_bytes", 0, "1 or more");
  if (undistort_cache_bytes < 1) return broken("undistort_cache_bytes", 0, "1 or more");
  return Status::Ok();
}

Status EngineTuning::Check() const {
  VEDUTA_RETURN_IF_ERROR(Named("database", database.Check()));
  VEDUTA_RETURN_IF_ERROR(Named("prepare", prepare.Check()));
  return Named("ingest", ingest.Check());
}

Result<std::unique_ptr<Engine>> EngineParts::Open(const std::string& path,
                                                  const EngineOptions& options,
                                                  EngineTuning tuning) {
  const Status checked = options.Check();
  if (!checked.ok()) return Status(checked.code(), "options." + checked.message());
  tuning.database.create = options.create;
  tuning.database.read_only = options.read_only;
  tuning.database.sync_wal = options.sync;
  tuning.database.block_cache_bytes = options.block_cache_bytes;
  tuning.ingest.feature_cache_bytes = options.feature_cache_bytes;
  VEDUTA_RETURN_IF_ERROR(Named("options", tuning.Check()));

  auto parts = std::make_unique<EngineParts>();
  parts->options = options;
  if (options.thread_count == 0) {
    parts->options.thread_count = std::max(1u, std::thread::hardware_concurrency());
  }
  parts->tuning = tuning;
  VEDUTA_ASSIGN_OR_RETURN(parts->database, Database::Open(path, tuning.database));
  parts->tables = std::make_unique<UndistortCache>(options.undistort_cache_bytes);
  parts->preparer =
      std::make_unique<PhotoPreparer>(parts->database.get(), parts->tables.get(), tuning.prepare);
  parts->pool = std::make_unique<ThreadPool>(parts->options.thread_count - 1);
  parts->writer = std::make_unique<Writer>(parts->database.get());
  parts->RenewCaches();
  parts->scheduler = std::make_unique<Scheduler>(parts->writer.get(), parts->preparer.get(),
                                                 &parts->ingest, parts->pool.get());
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
  {
    const std::lock_guard lock(caches_mutex);
    if (const auto found = cameras.find(name); found != cameras.end()) return found->second;
  }
  VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera,
                          veduta::FindCamera(*database->GetSnapshot(), name));
  const std::lock_guard lock(caches_mutex);
  return cameras[name] = camera;
}

std::shared_ptr<EngineCaches> EngineParts::GetCaches() {
  const std::lock_guard lock(caches_mutex);
  return caches;
}

void EngineParts::RenewCaches() {
  auto renewed = std::make_shared<EngineCaches>(tuning.ingest);
  ingest = std::make_unique<Ingest>(database.get(), &renewed->retrieval, &renewed->features,
                                    pool.get(), tuning.ingest);
  const std::lock_guard lock(caches_mutex);
  caches = std::move(renewed);
  cameras.clear();
}

}  // namespace veduta
