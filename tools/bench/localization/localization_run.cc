// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/localization/localization_run.h"

#include <utility>

#include "storage/base/stopwatch.h"

namespace veduta::localization {
namespace {

constexpr const char* kCamera = "camera";

Status AddAll(Engine* engine, std::span<const orders::OrderedPhoto> photos) {
  std::vector<PhotoSubmission> submissions;
  for (const orders::OrderedPhoto& photo : photos)
    submissions.push_back({{photo.name, photo.path, {}}, kCamera, "localization"});
  Status failure;
  VEDUTA_RETURN_IF_ERROR(engine->AddPhotos(submissions, [&](const AddOutcome& outcome) {
    if (failure.ok()) failure = outcome.failure;
  }));
  return failure;
}

Status ReadPoses(const Questions& questions, std::span<const orders::OrderedPhoto> photos,
                 Poses* poses) {
  for (const orders::OrderedPhoto& photo : photos) {
    VEDUTA_ASSIGN_OR_RETURN(const ImageAnswer image, questions.Image(photo.name));
    if (image.cam_from_world)
      poses->emplace(photo.name, ToPose(image.reconstruction, *image.cam_from_world));
  }
  return {};
}

}  // namespace

Pose ToPose(ReconstructionId reconstruction, const PlainPose& pose) {
  const auto& q = pose.rotation_wxyz;
  return {reconstruction.value,
          {Eigen::Quaterniond(q[0], q[1], q[2], q[3]), Eigen::Vector3d(pose.translation.data())}};
}

Result<LocalizationRun> RunLocalization(std::span<const orders::OrderedPhoto> added,
                                        std::span<const orders::OrderedPhoto> asked,
                                        const CameraModel& camera, bool is_unknown,
                                        uint32_t threads, const std::string& folder) {
  EngineOptions options;
  options.create = true;
  options.sync = false;
  options.thread_count = threads;
  VEDUTA_ASSIGN_OR_RETURN(const std::unique_ptr<Engine> engine,
                          Engine::Open(folder + "/database", options));
  VEDUTA_RETURN_IF_ERROR(engine->AddCamera(kCamera, camera, "veduta-bench-localization").status());
  VEDUTA_RETURN_IF_ERROR(AddAll(engine.get(), added));
  LocalizationRun run;
  run.focal_px = camera.fx;
  VEDUTA_RETURN_IF_ERROR(ReadPoses(engine->Ask(), added, &run.before));
  VEDUTA_ASSIGN_OR_RETURN(const std::string digest, engine->Ask().Digest());
  std::vector<LocalizeRequest> requests;
  for (const orders::OrderedPhoto& photo : asked)
    requests.push_back({{photo.name, photo.path, {}}, is_unknown ? "" : kCamera});
  Stopwatch watch;
  VEDUTA_RETURN_IF_ERROR(engine->Ask().Localize(
      requests, [&](const LocalizedPhoto& photo) { run.asked.push_back(photo); }));
  run.seconds = watch.LapMs() / 1000;
  VEDUTA_ASSIGN_OR_RETURN(const std::string digest_after, engine->Ask().Digest());
  if (digest != digest_after) return Status::Corruption("localising has changed the database");
  VEDUTA_RETURN_IF_ERROR(AddAll(engine.get(), asked));
  VEDUTA_RETURN_IF_ERROR(ReadPoses(engine->Ask(), added, &run.after));
  VEDUTA_RETURN_IF_ERROR(ReadPoses(engine->Ask(), asked, &run.after));
  return run;
}

}  // namespace veduta::localization
