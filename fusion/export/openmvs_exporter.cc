// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <limits>
#include <vector>

#include "fusion/export/exporter.h"
#include "fusion/export/output_file.h"
#include "fusion/export/told_scene.h"
#include "fusion/export/undistorted_photos.h"

namespace veduta {
namespace {

// The fields are those of OpenMVS's libs/MVS/Interface.h, little-endian. Version 2 of them, which
// programs read since 2018; later ones only add what we have not. Pixels are ours: the centre of
// the top-left one is (0, 0).
constexpr char kMagic[] = {'M', 'V', 'S', 'I'};
constexpr uint32_t kVersion = 2;

class MvsStream final {
 public:
  explicit MvsStream(std::ostream* stream) : stream_(stream) {}

  template <typename T>
  MvsStream& operator<<(T number) requires std::is_arithmetic_v<T> {
    stream_->write(reinterpret_cast<const char*>(&number), sizeof(number));
    return *this;
  }
  MvsStream& operator<<(const std::string& text) {
    *this << static_cast<uint64_t>(text.size());
    stream_->write(text.data(), static_cast<std::streamsize>(text.size()));
    return *this;
  }
  // Row by row.
  template <typename Derived>
  MvsStream& operator<<(const Eigen::MatrixBase<Derived>& matrix) {
    for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
      for (Eigen::Index column = 0; column < matrix.cols(); ++column)
        *this << static_cast<double>(matrix(row, column));
    }
    return *this;
  }

 private:
  std::ostream* const stream_;
};

struct MvsVertex {
  Eigen::Vector3f position;
  std::array<uint8_t, 3> rgb;
  std::vector<uint32_t> views;  // their places in the list of images
};

class OpenMvsExporter final : public Exporter {
 public:
  OpenMvsExporter(const Snapshot& snapshot, bool with_hidden)
      : snapshot_(snapshot), with_hidden_(with_hidden) {}

  Result<ExportedModel> Write(const ReconstructionRecord& record,
                              const std::string& folder) override {
    VEDUTA_ASSIGN_OR_RETURN(const Scene scene, LoadToldScene(snapshot_, record.id, with_hidden_));
    VEDUTA_ASSIGN_OR_RETURN(const auto photos, WriteUndistorted(snapshot_, scene, folder));
    std::map<ImageId, uint32_t> places;
    for (const auto& [id, photo] : photos) places.emplace(id, places.size());
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<MvsVertex> vertices, VerticesOf(record, places));
    OutputFile file(folder + "/scene.mvs");
    MvsStream out(&file.stream());
    file.stream().write(kMagic, sizeof(kMagic));
    out << kVersion << uint32_t{0};  // reserved
    WritePhotos(photos, &out);
    WriteVertices(vertices, &out);
    VEDUTA_RETURN_IF_ERROR(file.Close());
    return ExportedModel{record.id, folder, photos.size(), vertices.size(), 0, 0};
  }

 private:
  // A point that only one of these images sees is none.
  Result<std::vector<MvsVertex>> VerticesOf(const ReconstructionRecord& record,
                                            const std::map<ImageId, uint32_t>& places) const {
    std::vector<MvsVertex> vertices;
    VEDUTA_RETURN_IF_ERROR(snapshot_.ScanPointBlocks(
        record.id, record.points_generation, [&](const PointBlock& block) {
          for (const PointRecord& point : block.points) {
            MvsVertex vertex{point.position.cast<float>(), point.rgb, {}};
            for (const TrackElement& element : point.track) {
              const auto place = places.find(element.image);
              if (place != places.end()) vertex.views.push_back(place->second);
            }
            if (vertex.views.size() >= 2) vertices.push_back(std::move(vertex));
          }
          return true;
        }));
    return vertices;
  }

  // Each photo has a platform of its own, with one camera in its middle and one pose.
  static void WritePhotos(const std::map<ImageId, UndistortedPhoto>& photos, MvsStream* out) {
    const uint64_t one = 1, count = photos.size();
    *out << count;
    for (const auto& [id, photo] : photos) {
      const ViewGeometry& view = photo.geometry;
      Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
      k << view.camera.fx, 0, view.camera.cx, 0, view.camera.fy, view.camera.cy, 0, 0, 1;
      *out << std::string("platform") << one << std::string("camera") << view.width_px
           << view.height_px << k << Eigen::Matrix3d::Identity() << Eigen::Vector3d::Zero() << one
           << view.cam_from_world.rotation.toRotationMatrix() << view.cam_from_world.Center();
    }
    *out << count;
    uint32_t platform = 0;
    for (const auto& [id, photo] : photos)
      *out << photo.path << platform++ << uint32_t{0} << uint32_t{0};
  }

  static void WriteVertices(const std::vector<MvsVertex>& vertices, MvsStream* out) {
    const uint64_t none = 0, count = vertices.size();
    *out << count;
    for (const MvsVertex& vertex : vertices) {
      for (const float coordinate : vertex.position) *out << coordinate;
      *out << static_cast<uint64_t>(vertex.views.size());
      for (const uint32_t view : vertex.views) *out << view << 0.0f;  // confidence: not told
    }
    *out << none << count;  // no normals; colours, blue first
    for (const MvsVertex& vertex : vertices)
      *out << vertex.rgb[2] << vertex.rgb[1] << vertex.rgb[0];
    *out << none << none << none << Eigen::Matrix4d::Identity();  // no lines; the frame is ours
  }

  const Snapshot& snapshot_;
  const bool with_hidden_;
};

}  // namespace

std::unique_ptr<Exporter> MakeOpenMvsExporter(const Snapshot& snapshot,
                                              const ExportRequest& request) {
  return std::make_unique<OpenMvsExporter>(snapshot, request.with_hidden);
}

}  // namespace veduta
