// SPDX-License-Identifier: Apache-2.0
// Engine::Import.
#include <algorithm>
#include <cstdio>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "engine/colmap/colmap_model.h"
#include "engine/engine.h"
#include "engine/model_photos.h"
#include "engine/parts.h"
#include "engine/photo_list.h"
#include "engine/query/verdict_text.h"

namespace veduta {
namespace {

class Importing final {
 public:
  Importing(Engine* engine, EngineParts* parts, const ImportRequest& request, ColmapModel model)
      : engine_(*engine), parts_(*parts), request_(request), model_(std::move(model)) {
    for (const ModelImage& image : model_.images)
      answer_.photos.push_back({image.name, {}, {}, {}, {}});
    if (!model_.origin.isZero()) {
      const Eigen::Matrix<int64_t, 3, 1> origin = model_.origin.cast<int64_t>();
      answer_.messages.push_back(
          "the model lies far from where its coordinates begin: " + std::to_string(origin.x()) +
          ", " + std::to_string(origin.y()) + ", " + std::to_string(origin.z()) +
          " was taken from its positions");
    }
  }

  // Finds the photos of the model that are there, and stores their cameras.
  Status FindPhotos() {
    std::map<uint32_t, std::string> cameras;
    files_.resize(model_.images.size());
    for (uint32_t i = 0; i < model_.images.size(); ++i) {
      const ModelImage& image = model_.images[i];
      Result<ModelPhotoFile> file = FindModelPhoto(request_.photos, image.name);
      if (!file.ok()) {
        answer_.photos[i].why_not = file.status().message();
        continue;
      }
      if (!cameras.contains(image.camera)) {
        VEDUTA_ASSIGN_OR_RETURN(cameras[image.camera], CameraOf(image.camera));
      }
      AwaitedPose awaited;
      for (const uint32_t partner : image.seen_with) {
        if (!files_[partner].empty()) awaited.seen_with.push_back(files_[partner]);
      }
      files_[i] = file->name;
      submissions_.push_back({{std::move(file->name), std::move(file->path), {}},
                              cameras[image.camera],
                              request_.contributor});
      awaited_.push_back(std::move(awaited));
      submitted_.push_back(i);
    }
    if (submissions_.empty())
      return Status::NotFound("no photo of the model is in " + request_.photos + ", as " +
                              model_.images.front().name + ": " + answer_.photos.front().why_not);
    return Status::Ok();
  }

  Status Add(const std::function<void(const AddOutcome&)>& report, const std::stop_token& stop,
             const std::function<void(const FollowUp&)>& followed) {
    const auto note = [&](const AddOutcome& outcome) {
      Note(outcome);
      if (report) report(outcome);
    };
    return AddList(&parts_, submissions_, awaited_, note, stop, followed);
  }

  Status GivePoses() {
    Writer::Turn turn = parts_.writer->Take();
    VEDUTA_ASSIGN_OR_RETURN(const ModelFounding founded,
                            parts_.ingest->Found(poses_, request_.contributor));
    answer_.reconstruction = founded.reconstruction;
    answer_.points = founded.point_count;
    for (ImportedPhoto& photo : answer_.photos)
      photo.was_given_pose = std::ranges::binary_search(founded.placed, photo.image);
    return Status::Ok();
  }

  // Once all that follows is done.
  Result<ImportAnswer> Answer() {
    const std::shared_ptr<const Snapshot> snapshot = parts_.database->GetSnapshot();
    for (ImportedPhoto& photo : answer_.photos) {
      if (!photo.image.valid()) continue;
      VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose,
                              snapshot->FindPose(photo.image));
      VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, snapshot->GetImage(photo.image));
      if (pose) {
        photo.reconstruction = pose->reconstruction;
      } else {
        photo.why_not = image.detail;
      }
    }
    return std::move(answer_);
  }

 private:
  // The outcomes come in the order of the submissions.
  void Note(const AddOutcome& outcome) {
    const uint32_t i = submitted_[noted_++];
    ImportedPhoto& photo = answer_.photos[i];
    if (!outcome.failure.ok()) {
      photo.why_not = outcome.failure.message();
    } else if (!outcome.duplicate && outcome.verdict == Verdict::kRejected) {
      photo.why_not = ReasonText(outcome.reason);
      if (!outcome.detail.empty()) photo.why_not += ": " + outcome.detail;
    } else if (!images_.insert(outcome.id).second) {
      photo.why_not = "the model has it twice";
    } else {
      photo.image = outcome.id;
      poses_.push_back({outcome.id, model_.images[i].cam_from_world});
    }
  }

  // The name of a stored camera with the same intrinsics, which is stored where there is none.
  Result<std::string> CameraOf(uint32_t id) {
    const ModelCamera& camera = *std::ranges::lower_bound(model_.cameras, id, {}, &ModelCamera::id);
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<CameraRecord> stored,
                            parts_.database->GetSnapshot()->ListCameras());
    std::set<std::string> names;
    for (const CameraRecord& known : stored) {
      if (known.model == camera.model) return known.name;
      names.insert(known.name);
    }
    std::string name = "imported " + std::to_string(id);
    while (names.contains(name)) name += "'";
    char off[80];
    std::snprintf(off, sizeof(off), "off by %.3f px in the mean and %.3f px at most",
                  camera.residual.mean_px, camera.residual.largest_px);
    if (camera.residual.largest_px > kResidualGoodPx) {
      answer_.messages.push_back("camera " + std::to_string(id) + " (" + camera.lens +
                                 ") is expressed badly by ours, " + off +
                                 "; 'colmap image_undistorter' makes a model that is not");
    }
    const std::string source =
        "from a model of COLMAP: camera " + std::to_string(id) + ", " + camera.lens + ", " + off;
    VEDUTA_RETURN_IF_ERROR(engine_.AddCamera(name, camera.model, source).status());
    return name;
  }

  Engine& engine_;
  EngineParts& parts_;
  const ImportRequest& request_;
  const ColmapModel model_;
  std::vector<std::string> files_;  // what photos are called in the folder; empty: not there
  // Of each photo that is there: its submission, what it is compared with, its place in the model.
  std::vector<PhotoSubmission> submissions_;
  std::vector<AwaitedPose> awaited_;
  std::vector<uint32_t> submitted_;
  size_t noted_ = 0;
  std::set<ImageId> images_;
  std::vector<ModelPose> poses_;
  ImportAnswer answer_;
};

}  // namespace

Result<ImportAnswer> Engine::Import(const ImportRequest& request, std::stop_token stop,
                                    const std::function<void(const AddOutcome&)>& report,
                                    const std::function<void(const FollowUp&)>& followed) {
  const std::shared_ptr<EngineParts> parts = parts_;
  VEDUTA_ASSIGN_OR_RETURN(ColmapModel model, ReadColmapModel(request.model));
  Importing importing(this, parts.get(), request, std::move(model));
  VEDUTA_RETURN_IF_ERROR(importing.FindPhotos());
  VEDUTA_RETURN_IF_ERROR(importing.Add(report, stop, followed));
  VEDUTA_RETURN_IF_ERROR(importing.GivePoses());
  VEDUTA_RETURN_IF_ERROR(Settle(stop, followed));
  return importing.Answer();
}

}  // namespace veduta
