// SPDX-License-Identifier: Apache-2.0
#pragma once
// Applies prepared photos one after another, each as one transaction, and carries out the work that
// follows from them (due_work.h), each step as a transaction of its own.

#include <optional>
#include <span>
#include <string>

#include "engine/camera/decoder.h"
#include "engine/door/engine_options.h"
#include "engine/door/submission.h"
#include "engine/ingest/due_work.h"
#include "engine/ingest/ingest_options.h"
#include "engine/ingest/ingest_parts.h"
#include "engine/ingest/large_adjustment.h"
#include "engine/ingest/model_founding.h"
#include "engine/ingest/photo_admission.h"
#include "engine/ingest/write_scope.h"
#include "engine/mapping/repetition.h"
#include "engine/photo/photo_preparer.h"

namespace veduta {

// What is computed without a turn of the writer (DueStep::is_long), by whoever can do that.
struct LongSteps {
  // One that is being computed: steps that must wait for it are passed over.
  std::optional<DueStep> at_work;
  // Whether one is wanted as soon as it is due, and not only when it is the next step.
  bool at_once = false;
  // Receives one that is due, which is left to the caller.
  std::optional<DueStep> next;
};

// What a photo was compared with others by.
struct ComparedPhoto;
struct StoredDouble;  // engine/ingest/double_finder.h

// One thread at a time, guarded by its owner (the engine's writer). The four pointers must outlive
// it.
class Ingest final {
 public:
  // The options must have passed their Check. The decoder, which must outlive it, too, is asked
  // where doubles are refused.
  Ingest(Database* database, Retrieval* retrieval, ImageFeatureCache* features, ThreadPool* pool,
         IngestOptions options, Doubles doubles = Doubles::kKeep,
         const PhotoDecoder& decoder = DecoderInProcess());
  Ingest(const Ingest&) = delete;
  Ingest& operator=(const Ingest&) = delete;

  // Commits the photo with its verdict, and with whatever its verdict brings about in the same
  // commit: `propagated` of the outcome names the earlier photos that it founded with. A camera
  // whose id is not valid() is stored in the same commit, under its name where that is free and
  // under another one otherwise, which the outcome tells. An error
  // means that nothing of the photo is visible; kNoMemory where the memory is too short. A
  // failure of kBusy in the outcome: a copy was removed since it was prepared: prepare it again.
  Result<AddOutcome> Apply(PreparedPhoto photo, const CameraRecord& camera,
                           const std::string& contributor);

  // Takes a stored photo out and commits: RemovePhoto. An error means that nothing has changed.
  Result<RemovedPhoto> Remove(ImageId image, const std::string& actor, const std::string& why);

  // Takes a photo's pose and commits that it gets none: ForbidPose. An error means that nothing has
  // changed.
  Status ForbidPose(ImageId image, const std::string& actor, const std::string& reason);

  // Gives stored photos the poses that came with a model, and commits: FoundByModel. An error means
  // that nothing has changed.
  Result<ModelFounding> Found(std::span<const ModelPose> poses, const std::string& actor);

  // Runs and commits the next step that is due; none when nothing is, or nothing but a vocabulary,
  // which is never trained here. Other long steps are run here where no `long_steps` are given. A
  // step that fails says so in `status`, leaves nothing visible and is passed over from then on,
  // until TryFailedAgain. Where the state cannot even be read, one FollowUp says so and no step is
  // run until then. So a loop until none always ends.
  std::optional<FollowUp> RunNextStep(LongSteps* long_steps = nullptr);
  // Commits a large adjustment that was computed without a turn.
  FollowUp Commit(LargeAdjustment* adjustment, ReconstructionId reconstruction);
  // A long step that has failed is passed over from then on, until TryFailedAgain.
  void SetAside(const DueStep& step) { set_aside_.Add(step); }
  // Steps that have failed are due again, once each: memory or the disk may be back.
  void TryFailedAgain();

 private:
  Result<AddOutcome> AdmitAndPlace(PreparedPhoto photo, CameraRecord camera,
                                   const std::string& contributor);
  Result<AddOutcome> StoreRejection(const PreparedPhoto& photo, const CameraRecord& camera,
                                    ImageRecord record, WriteScope scope);
  // Where the name is taken, the photo is stored only in the place of a smaller copy of it.
  Result<AddOutcome> Place(PreparedPhoto photo, const CameraRecord& camera, ImageRecord record,
                           bool is_name_taken, WriteScope scope);
  // A double of more pixels takes the place of the stored photo, where that is asked for.
  Result<AddOutcome> AnswerDouble(const StoredDouble& stored, const PreparedPhoto& photo,
                                  const CameraRecord& camera, ImageRecord record,
                                  const ComparedPhoto& compared, WriteScope scope);
  Result<std::optional<DueStep>> FindStep(const Snapshot& snapshot,
                                          const std::optional<DueStep>& at_work) const;
  std::optional<DueStep> FindLong(const Snapshot& snapshot) const;
  FollowUp Run(const DueStep& step, WriteScope scope);

  const IngestOptions options_;
  CityMap map_;
  RepetitionMemory repetitions_{1 << 18};  // pairs; chosen by hand
  const IngestParts parts_;
  const Doubles doubles_;
  const PhotoDecoder& decoder_;
  StepsSetAside set_aside_;
  bool is_state_unreadable_ = false;
};

}  // namespace veduta
