// SPDX-License-Identifier: Apache-2.0

#include <filesystem>
#include <map>
#include <optional>
#include <set>

#include "engine/camera/projection.h"
#include "engine/camera/undistorter.h"
#include "engine/photo/derived_features.h"
#include "fusion/export/colmap_files.h"
#include "fusion/export/exporter.h"
#include "fusion/export/model_names.h"
#include "fusion/export/told_scene.h"
#include "fusion/export/undistorted_photos.h"

namespace veduta {
namespace {

constexpr double kColmapPixelOffset = 0.5;
constexpr uint64_t kNoPoint = 0;

// For features that are computed again: a table or two. Chosen by hand; not measured.
constexpr uint64_t kTablesBytesMax = 64ull << 20;

// The photos that belong to the model, where they are undistorted.
using UndistortedPhotos = std::map<ImageId, UndistortedPhoto>;

class ColmapModel final {
 public:
  ColmapModel(const Snapshot& snapshot, const ReconstructionRecord& record,
              const std::set<ImageId>& untold, ColmapFiles* files,
              const UndistortedPhotos* undistorted)
      : snapshot_(snapshot),
        record_(record),
        untold_(untold),
        files_(files),
        undistorted_(undistorted) {}

  Status Write(const std::vector<PoseRecord>& poses) {
    VEDUTA_RETURN_IF_ERROR(FindNames(poses));
    VEDUTA_RETURN_IF_ERROR(WritePoints());
    for (const PoseRecord& pose : poses) VEDUTA_RETURN_IF_ERROR(WriteImage(pose));
    for (const auto& [id, camera] : cameras_) files_->AddCamera(camera);
    return files_->Finish();
  }
  uint64_t point_count() const { return point_count_; }

 private:
  // Points first: they get their numbers here. A track names features by their place in the image,
  // where all of an image's features are written, so indices carry over.
  Status WritePoints() {
    return snapshot_.ScanPointBlocks(record_.id, record_.points_generation,
                                     [&](const PointBlock& block) {
                                       for (const PointRecord& point : block.points)
                                         WritePoint(point);
                                       return true;
                                     });
  }

  // Without images that are left out; a point that only one other sees is none.
  void WritePoint(PointRecord point) {
    std::erase_if(point.track, [&](const TrackElement& e) { return untold_.contains(e.image); });
    const bool is_written = point.track.size() >= 2;
    numbers_[point.id] = is_written ? ++point_count_ : kNoPoint;
    if (is_written) files_->AddPoint(point_count_, point);
  }

  // Whether the photos are as they were taken, and their lens is one that COLMAP knows.
  bool IsOpenCvModel(const CameraModel& m) const {
    return undistorted_ == nullptr && IsDistorted(m) && m.u0 == m.cx && m.v0 == m.cy;
  }

  Status FindNames(const std::vector<PoseRecord>& poses) {
    if (undistorted_ != nullptr) {
      for (const auto& [id, photo] : *undistorted_)
        names_[id] = std::filesystem::path(photo.path).filename().string();
      return Status::Ok();
    }
    std::vector<ImageRecord> images(poses.size());
    std::vector<const ImageRecord*> all;
    for (size_t i = 0; i < poses.size(); ++i) {
      VEDUTA_ASSIGN_OR_RETURN(images[i], snapshot_.GetImage(poses[i].image));
      all.push_back(&images[i]);
    }
    names_ = ModelNames(all);
    return Status::Ok();
  }

  Status WriteImage(const PoseRecord& pose) {
    VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, snapshot_.GetImage(pose.image));
    VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera, snapshot_.GetCamera(image.camera));
    VEDUTA_ASSIGN_OR_RETURN(const Features features,
                            ReadOrDeriveFeatures(snapshot_, image, camera, &tables_));
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<Observation> observations,
                            snapshot_.GetObservations(image.id));
    VEDUTA_RETURN_IF_ERROR(CheckObservations(image, features, observations));
    const ColmapCamera& written =
        cameras_.try_emplace(image.camera, CameraOf(image, camera.model)).first->second;
    files_->AddImage({image.id, image.camera, names_.at(image.id), pose.cam_from_world,
                      FeaturesOf(features, observations, camera.model, written)});
    return Status::Ok();
  }

  Status CheckObservations(const ImageRecord& image, const Features& features,
                           const std::vector<Observation>& observations) const {
    for (const Observation& o : observations) {
      if (o.feature < features.size() && numbers_.contains(o.point)) continue;
      return Status::Corruption("family observations: image " + image.name + " observes point " +
                                std::to_string(o.point.home.value) + "/" +
                                std::to_string(o.point.ordinal) +
                                ", which does not exist, or by a feature that does not");
    }
    return Status::Ok();
  }

  // All features of an image, each with its point's number. Those of an undistorted photo may lie
  // where it was cropped.
  std::vector<ColmapFeature> FeaturesOf(const Features& features,
                                        const std::vector<Observation>& observations,
                                        const CameraModel& camera,
                                        const ColmapCamera& written) const {
    // From the features' pixels to COLMAP's, of the picture that is cropped on each side.
    const double right_px = written.params[2] - camera.cx, down_px = written.params[3] - camera.cy;
    std::vector<ColmapFeature> all;
    auto next = observations.begin();
    for (FeatureIndex f = 0; f < features.size(); ++f) {
      Eigen::Vector2d x(features.keypoints[f].x_px, features.keypoints[f].y_px);
      if (IsOpenCvModel(camera)) x = DistortPixel(camera, x);
      const bool is_seen = next != observations.end() && next->feature == f;
      all.push_back(
          {x.x() + right_px, x.y() + down_px, is_seen ? numbers_.at((next++)->point) : kNoPoint});
    }
    return all;
  }

  // Of the photos as they are written: all of one camera are undistorted and cropped alike.
  ColmapCamera CameraOf(const ImageRecord& image, const CameraModel& m) const {
    ColmapCamera written{image.camera, ColmapCameraModel::kPinhole, m.width_px, m.height_px, {}};
    written.params = {m.fx, m.fy, m.cx + kColmapPixelOffset, m.cy + kColmapPixelOffset};
    if (undistorted_ != nullptr) {
      const ViewGeometry& view = undistorted_->at(image.id).geometry;
      written.width_px = view.width_px, written.height_px = view.height_px;
      written.params = {view.camera.fx, view.camera.fy, view.camera.cx + kColmapPixelOffset,
                        view.camera.cy + kColmapPixelOffset};
    } else if (IsOpenCvModel(m)) {
      written.model = ColmapCameraModel::kOpenCv;
      written.params.insert(written.params.end(), {m.k1, m.k2, 0, 0});
    }
    return written;
  }

  const Snapshot& snapshot_;
  const ReconstructionRecord& record_;
  const std::set<ImageId>& untold_;
  ColmapFiles* const files_;
  const UndistortedPhotos* const undistorted_;  // null: the photos are as they were taken
  uint64_t point_count_ = 0;
  std::map<PointId, uint64_t> numbers_;  // kNoPoint for those that are not written
  std::map<ImageId, std::string> names_;
  std::map<CameraId, ColmapCamera> cameras_;  // of images that were written
  UndistortCache tables_{kTablesBytesMax};
};

using OpenColmap = Result<std::unique_ptr<ColmapFiles>> (*)(const std::string& folder);

class ColmapExporter final : public Exporter {
 public:
  enum class Photos : uint8_t { kAsTaken, kUndistorted };
  ColmapExporter(const Snapshot& snapshot, const ExportRequest& request, OpenColmap open,
                 Photos photos)
      : snapshot_(snapshot), with_hidden_(request.with_hidden), open_(open), photos_(photos) {}

  Result<ExportedModel> Write(const ReconstructionRecord& record,
                              const std::string& folder) override {
    if (!poses_) {
      poses_.emplace();
      VEDUTA_ASSIGN_OR_RETURN(untold_, ListUntold(snapshot_, with_hidden_));
      VEDUTA_RETURN_IF_ERROR(snapshot_.ScanPoses([&](const PoseRecord& pose) {
        if (!untold_.contains(pose.image)) (*poses_)[pose.reconstruction].push_back(pose);
        return true;
      }));
    }
    const std::vector<PoseRecord>& poses = (*poses_)[record.id];
    UndistortedPhotos undistorted;
    std::string model_folder = folder;
    if (photos_ == Photos::kUndistorted) {
      VEDUTA_ASSIGN_OR_RETURN(const Scene scene, LoadToldScene(snapshot_, record.id, with_hidden_));
      VEDUTA_ASSIGN_OR_RETURN(undistorted, WriteUndistorted(snapshot_, scene, folder));
      model_folder += "/sparse/0";
      std::error_code error;
      std::filesystem::create_directories(model_folder, error);
      if (error)
        return Status::IoError("cannot make folder " + model_folder + ": " + error.message());
    }
    VEDUTA_ASSIGN_OR_RETURN(const std::unique_ptr<ColmapFiles> files, open_(model_folder));
    ColmapModel model(snapshot_, record, untold_, files.get(),
                      photos_ == Photos::kUndistorted ? &undistorted : nullptr);
    VEDUTA_RETURN_IF_ERROR(model.Write(poses));
    return ExportedModel{record.id, folder, poses.size(), model.point_count(), 0, 0};
  }

 private:
  const Snapshot& snapshot_;
  const bool with_hidden_;
  const OpenColmap open_;
  const Photos photos_;
  std::optional<std::map<ReconstructionId, std::vector<PoseRecord>>> poses_;  // once asked for
  std::set<ImageId> untold_;                                                  // likewise
};

}  // namespace

std::unique_ptr<Exporter> MakeColmapExporter(const Snapshot& snapshot,
                                             const ExportRequest& request) {
  return std::make_unique<ColmapExporter>(snapshot, request, OpenColmapText,
                                          ColmapExporter::Photos::kAsTaken);
}

std::unique_ptr<Exporter> MakeColmapBinaryExporter(const Snapshot& snapshot,
                                                   const ExportRequest& request) {
  return std::make_unique<ColmapExporter>(snapshot, request, OpenColmapBinary,
                                          ColmapExporter::Photos::kAsTaken);
}

std::unique_ptr<Exporter> MakeColmapUndistortedExporter(const Snapshot& snapshot,
                                                        const ExportRequest& request) {
  return std::make_unique<ColmapExporter>(snapshot, request, OpenColmapBinary,
                                          ColmapExporter::Photos::kUndistorted);
}

}  // namespace veduta
