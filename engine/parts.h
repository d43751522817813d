// SPDX-License-Identifier: Apache-2.0
#pragma once
// What stands behind the door, for the rooms that carry out its functions, and for tests and tools.
// A program that embeds Veduta includes engine/engine.h alone.

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "engine/camera/decoder.h"
#include "engine/camera/undistorter.h"
#include "engine/engine.h"
#include "engine/ingest/ingest.h"
#include "engine/photo/image_features.h"
#include "engine/photo/photo_preparer.h"
#include "engine/query/unsure_poses.h"
#include "engine/query/visibility.h"
#include "engine/retrieval/retrieval.h"
#include "engine/schedule/scheduler.h"
#include "engine/writer/claimable.h"
#include "engine/writer/writer.h"
#include "storage/base/lru_cache.h"
#include "storage/base/thread_pool.h"
#include "storage/database.h"
#include "storage/model/triangle_mesh.h"

namespace veduta {

// Every option of every algorithm. What EngineOptions names too is taken from there.
struct EngineTuning {
  DatabaseOptions database;
  PrepareOptions prepare;
  IngestOptions ingest;
  // Null: that of EngineOptions::decoder_program, or the engine's own threads.
  std::shared_ptr<const PhotoDecoder> decoder = {};

  Status Check() const;  // the first violated bound, named by its path and with its value
};

// Actions of entries of the journal on copies: storage/FORMAT.md.
inline constexpr const char* kCopyMade = "backup";
inline constexpr const char* kCopyDeleted = "backup-deleted";  // it could not be read

// A coarse part of a surface, and what is damaged below it and left out (SurfaceTileAnswer).
struct CoarseSurface {
  TriangleMesh mesh;
  std::vector<std::string> left_out;
};
// Files of the database as a backup found them, in the database's folder while one is made.
inline constexpr const char* kBackupLinks = "backup-links";

// Coarse parts of surfaces (fusion/surface_tiles.h) by what names them, and those that somebody is
// making now.
struct CoarseSurfaces {
  explicit CoarseSurfaces(uint64_t bytes_max) : meshes(bytes_max) {}

  LruCache<std::string, std::shared_ptr<const CoarseSurface>> meshes;
  std::mutex mutex;  // of `making`
  std::condition_variable made;
  std::set<std::string> making;
};

// Of EngineOptions::surface_cache_bytes, this part of the whole is for coarse parts of surfaces.
// Chosen by hand.
inline constexpr uint64_t kCoarseShare = 3;

// What one generation of open files is read by. Exchanged by Engine::Reopen: what was kept of a
// commit that failed must not be found again.
struct EngineCaches {
  EngineCaches(const IngestOptions& options, std::shared_ptr<std::mutex> preparing_vocabulary,
               const PhotoDecoder& decoder, uint64_t surface_bytes_max)
      : retrieval(options.retrieval, std::move(preparing_vocabulary), decoder),
        features(options.feature_cache_bytes, options.matched_count_max, decoder),
        surfaces(surface_bytes_max) {}

  Retrieval retrieval;
  ImageFeatureCache features;
  UnsureCache unsure;
  CoarseSurfaces surfaces;
};

// Destroyed from the bottom up: the scheduler's thread ends first.
struct EngineParts {
  // Engine::Open with every option open to tests.
  static Result<std::unique_ptr<Engine>> Open(const std::string& path, const EngineOptions& options,
                                              EngineTuning tuning);
  static EngineParts& Of(const Engine& engine) { return *engine.parts_; }
  static const std::shared_ptr<const Snapshot>& SnapshotOf(const Questions& questions);
  static EngineParts& Of(const Questions& questions);

  // Engine::AddCamera, with all else that is known of it; the number is a new one.
  Result<CameraId> AddCamera(CameraRecord camera);
  // The camera of that name, as it is now. Which one has a name is remembered: that never changes.
  Result<CameraRecord> FindCamera(const std::string& name);
  // The same of a submission, whose camera need not be named.
  Result<std::optional<CameraRecord>> FindNamed(const std::string& name);
  std::shared_ptr<EngineCaches> GetCaches();
  // Retrieval, features and the ingest engine anew; for who has the writer's turn.
  void RenewCaches();
  // Takes a turn and switches to a vocabulary that was prepared while the database was read by
  // `from`. kBusy where the database was opened again since. `turn_ms`, if given, receives how long
  // that took.
  Status Activate(const std::shared_ptr<EngineCaches>& from, Retrieval::Prepared prepared,
                  double* turn_ms = nullptr);
  // Scheduler::DoLongStep. Nothing when a step is not due any more, or when the database was opened
  // again meanwhile: then look again whether it is due.
  Result<std::optional<FollowUp>> DoLongStep(const DueStep& step);
  Result<std::optional<FollowUp>> TrainIfDue();
  Result<std::optional<FollowUp>> AdjustLarge(ReconstructionId reconstruction);

  // Engine::Reopen, for who has the writer's turn.
  Status Reopen(Writer::Turn* turn);

  // Rids the files of the bytes of removed photos, where there may be some, and opens them again.
  // For who has claimed `dense_pass`. Takes a turn.
  Status PurgeRemoved();
  // Writes an entry of this action on a copy of the database into the journal.
  Status NoteCopy(const std::string& action, const std::string& folder, Writer::Turn* turn);

  // Deletes kBackupLinks: a backup that was killed leaves them.
  Status DropBackupLinks() const;

  bool IsInLine(uint64_t upload);
  // Of a photo that waits on the disk; reads it from there.
  PhotoSource SourceOf(const UploadRecord& upload);
  // When its turn has come: off the disk, where it has ended, or has to wait for its camera with
  // too many others.
  void LeaveLine(const UploadRecord& upload, bool has_ended, const Result<AddOutcome>& answer);
  // Puts a photo in line that waits on the disk and is not in line, for who holds `lining_mutex`.
  Result<Ticket> Line(const UploadRecord& upload, std::optional<CameraRecord> camera,
                      AnswerCallback answered);
  // The same of one whose camera is named by its record, and may have got lost.
  Result<Ticket> LineStored(const UploadRecord& upload, AnswerCallback answered);
  // Takes out of the line, and off the disk, what waits or arrives in parts of the contributor or
  // the contribution that the request names. One whose turn has come has had it when this returns.
  // How many were taken out.
  Result<uint64_t> RemoveUploads(const RemoveRequest& request);
  // Forgets all of these that are wanted, and the bytes of those that are on their way. How many
  // those were.
  Result<size_t> DeletePartialUploads(
      const std::function<bool(const PartialUploadRecord&)>& is_wanted);
  // Forgets the contribution that the request names, or all of its contributor, whose photos are
  // gone.
  Status RemoveContributions(const RemoveRequest& request);
  // Whether a photo of this contributor may be a part of the contribution; nothing to ask for 0.
  Status CheckContribution(uint32_t contribution, const std::string& contributor);

  std::string path;  // of the database, as it was opened
  EngineOptions options;
  EngineTuning tuning;
  std::unique_ptr<Database> database;
  std::unique_ptr<UndistortCache> tables;
  std::unique_ptr<PhotoPreparer> preparer;
  std::unique_ptr<ThreadPool> pool;
  std::unique_ptr<Writer> writer;
  std::shared_ptr<std::mutex> preparing_vocabulary = std::make_shared<std::mutex>();
  std::mutex caches_mutex;  // of `caches` and `cameras`
  std::shared_ptr<EngineCaches> caches;
  std::map<std::string, CameraId> cameras;
  std::unique_ptr<Ingest> ingest;      // used with the writer's turn only
  std::mutex lining_mutex;             // held while a photo gets onto the disk and in line
  std::mutex uploads_mutex;            // of `uploads`; never held while anything is written
  std::map<uint64_t, Ticket> uploads;  // that are in line
  std::set<uint64_t> awaiting_camera;  // that left it for want of a camera, by `uploads_mutex`
  Claimable backing_up;                // claimed while a backup is made
  Claimable dense_pass;  // claimed while a dense pass or a removal runs: one at a time
  std::unique_ptr<Scheduler> scheduler;
};

// One snapshot and what is asked through it.
struct Questions::View {
  std::shared_ptr<EngineParts> parts;
  std::shared_ptr<EngineCaches> caches;
  std::shared_ptr<const Snapshot> snapshot;
  Sight sight;

  Visibility visibility() const { return {*snapshot, sight}; }
  // kNotFound where nothing of the reconstruction may be told.
  veduta::Status RefuseUnseen(ReconstructionId id) const;
};

}  // namespace veduta
