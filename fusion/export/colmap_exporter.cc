// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <map>
#include <optional>
#include <set>

#include "engine/camera/projection.h"
#include "engine/camera/undistorter.h"
#include "engine/photo/derived_features.h"
#include "fusion/export/exporter.h"

namespace veduta {
namespace {

constexpr double kColmapPixelOffset = 0.5;

// For features that are computed again: a table or two. Chosen by hand; not measured.
constexpr uint64_t kTablesBytesMax = 64ull << 20;

bool IsOpenCvModel(const CameraModel& m) {
  return IsDistorted(m) && m.u0 == m.cx && m.v0 == m.cy;
}

// COLMAP reads a name up to the first space (src/colmap/scene/reconstruction_io_text.cc) or the end
// of the line. So a space, a control character, and a % that would be taken for an escape, are
// written as in a URL (RFC 3986, section 2.1).
std::string ColmapName(const std::string& name) {
  std::string text;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    char escaped[4] = {c, 0, 0, 0};
    if (byte <= ' ' || byte == 0x7F || c == '%')
      std::snprintf(escaped, sizeof(escaped), "%%%02X", byte);
    text += escaped;
  }
  return text;
}

Result<std::ofstream> Create(const std::filesystem::path& path) {
  std::ofstream file(path);
  if (!file) return Status::IoError("cannot write " + path.string() + ": " + std::strerror(errno));
  file << std::setprecision(17);
  return file;
}

Status Close(std::ofstream* file, const std::filesystem::path& path) {
  file->close();
  return *file ? Status::Ok()
               : Status::IoError("cannot write " + path.string() + ": " + std::strerror(errno));
}

class ColmapModel final {
 public:
  ColmapModel(const Snapshot& snapshot, const ReconstructionRecord& record,
              std::filesystem::path folder)
      : snapshot_(snapshot), record_(record), folder_(std::move(folder)) {}

  Status Write(const std::vector<PoseRecord>& poses) {
    VEDUTA_RETURN_IF_ERROR(WritePoints());
    VEDUTA_RETURN_IF_ERROR(WriteImages(poses));
    return WriteCameras();
  }
  uint64_t point_count() const { return numbers_.size(); }

 private:
  // Points first: they get their numbers here. A track names features by their place in images.txt,
  // where all of an image's features are written, so indices carry over.
  Status WritePoints() {
    const auto path = folder_ / "points3D.txt";
    VEDUTA_ASSIGN_OR_RETURN(std::ofstream file, Create(path));
    file << "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n";
    VEDUTA_RETURN_IF_ERROR(snapshot_.ScanPointBlocks(
        record_.id, record_.points_generation, [&](const PointBlock& block) {
          for (const PointRecord& point : block.points) {
            const uint64_t number = numbers_.size() + 1;
            numbers_[point.id] = number;
            file << number << ' ' << point.position.x() << ' ' << point.position.y() << ' '
                 << point.position.z();
            for (const uint8_t channel : point.rgb) file << ' ' << static_cast<int>(channel);
            file << ' ' << point.error_px;
            for (const TrackElement& element : point.track)
              file << ' ' << element.image.value << ' ' << element.feature;
            file << '\n';
          }
          return true;
        }));
    return Close(&file, path);
  }

  Status WriteImages(const std::vector<PoseRecord>& poses) {
    const auto path = folder_ / "images.txt";
    VEDUTA_ASSIGN_OR_RETURN(std::ofstream file, Create(path));
    file << "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME (as in a URL: %20 is a "
            "space)\n# POINTS2D[] as (X, Y, POINT3D_ID)\n";
    for (const PoseRecord& pose : poses) {
      VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, snapshot_.GetImage(pose.image));
      VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera, snapshot_.GetCamera(image.camera));
      VEDUTA_ASSIGN_OR_RETURN(const Features features,
                              ReadOrDeriveFeatures(snapshot_, image, camera.model, &tables_));
      VEDUTA_ASSIGN_OR_RETURN(const std::vector<Observation> observations,
                              snapshot_.GetObservations(image.id));
      cameras_.insert(image.camera);
      const Eigen::Quaterniond& q = pose.cam_from_world.rotation;
      const Eigen::Vector3d& t = pose.cam_from_world.translation;
      file << image.id.value << ' ' << q.w() << ' ' << q.x() << ' ' << q.y() << ' ' << q.z() << ' '
           << t.x() << ' ' << t.y() << ' ' << t.z() << ' ' << image.camera.value << ' '
           << ColmapName(image.name) << '\n';
      VEDUTA_RETURN_IF_ERROR(CheckObservations(image, features, observations));
      WriteFeatures(features, observations, camera.model, &file);
    }
    return Close(&file, path);
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

  // All features of an image on one line, each with its point's number, or -1.
  void WriteFeatures(const Features& features, const std::vector<Observation>& observations,
                     const CameraModel& camera, std::ofstream* out) const {
    std::ofstream& file = *out;
    auto next = observations.begin();
    for (FeatureIndex f = 0; f < features.size(); ++f) {
      Eigen::Vector2d x(features.keypoints[f].x_px, features.keypoints[f].y_px);
      if (IsOpenCvModel(camera)) x = DistortPixel(camera, x);
      file << (f ? " " : "") << x.x() + kColmapPixelOffset << ' ' << x.y() + kColmapPixelOffset
           << ' ';
      if (next != observations.end() && next->feature == f) {
        file << numbers_.at((next++)->point);
      } else {
        file << -1;
      }
    }
    file << '\n';
  }

  Status WriteCameras() {
    const auto path = folder_ / "cameras.txt";
    VEDUTA_ASSIGN_OR_RETURN(std::ofstream file, Create(path));
    file << "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
    for (const CameraId id : cameras_) {
      VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera, snapshot_.GetCamera(id));
      const CameraModel& m = camera.model;
      file << id.value << ' ' << (IsOpenCvModel(m) ? "OPENCV" : "PINHOLE") << ' ' << m.width_px
           << ' ' << m.height_px << ' ' << m.fx << ' ' << m.fy << ' ' << m.cx + kColmapPixelOffset
           << ' ' << m.cy + kColmapPixelOffset;
      if (IsOpenCvModel(m)) file << ' ' << m.k1 << ' ' << m.k2 << " 0 0";
      file << '\n';
    }
    return Close(&file, path);
  }

  const Snapshot& snapshot_;
  const ReconstructionRecord& record_;
  const std::filesystem::path folder_;
  std::map<PointId, uint64_t> numbers_;
  std::set<CameraId> cameras_;
  UndistortCache tables_{kTablesBytesMax};
};

class ColmapExporter final : public Exporter {
 public:
  explicit ColmapExporter(const Snapshot& snapshot) : snapshot_(snapshot) {}

  Result<ExportedModel> Write(const ReconstructionRecord& record,
                              const std::string& folder) override {
    if (!poses_) {
      poses_.emplace();
      VEDUTA_RETURN_IF_ERROR(snapshot_.ScanPoses([&](const PoseRecord& pose) {
        (*poses_)[pose.reconstruction].push_back(pose);
        return true;
      }));
    }
    const std::vector<PoseRecord>& poses = (*poses_)[record.id];
    ColmapModel model(snapshot_, record, folder);
    VEDUTA_RETURN_IF_ERROR(model.Write(poses));
    return ExportedModel{record.id, folder, poses.size(), model.point_count(), 0, 0};
  }

 private:
  const Snapshot& snapshot_;
  std::optional<std::map<ReconstructionId, std::vector<PoseRecord>>> poses_;  // once asked for
};

}  // namespace

std::unique_ptr<Exporter> MakeColmapExporter(const Snapshot& snapshot, const ExportRequest&) {
  return std::make_unique<ColmapExporter>(snapshot);
}

}  // namespace veduta
