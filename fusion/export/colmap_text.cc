// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <iomanip>

#include "fusion/export/colmap_files.h"
#include "fusion/export/output_file.h"

namespace veduta {
namespace {

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

class ColmapText final : public ColmapFiles {
 public:
  explicit ColmapText(const std::string& folder)
      : cameras_(folder + "/cameras.txt"),
        images_(folder + "/images.txt"),
        points_(folder + "/points3D.txt") {
    for (OutputFile* file : {&cameras_, &images_, &points_})
      file->stream() << std::setprecision(17);
    cameras_.stream() << "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
    images_.stream()
        << "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME (as in a URL: %20 is a "
           "space)\n# POINTS2D[] as (X, Y, POINT3D_ID)\n";
    points_.stream()
        << "# POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n";
  }

  Status Check() const {
    for (const OutputFile* file : {&cameras_, &images_, &points_})
      VEDUTA_RETURN_IF_ERROR(file->Check());
    return Status::Ok();
  }

  void AddCamera(const ColmapCamera& camera) override {
    cameras_.stream() << camera.id.value
                      << (camera.model == ColmapCameraModel::kOpenCv ? " OPENCV " : " PINHOLE ")
                      << camera.width_px << ' ' << camera.height_px;
    for (const double value : camera.params) cameras_.stream() << ' ' << value;
    cameras_.stream() << '\n';
  }

  void AddImage(const ColmapImage& image) override {
    const Eigen::Quaterniond& q = image.cam_from_world.rotation;
    const Eigen::Vector3d& t = image.cam_from_world.translation;
    std::ostream& file = images_.stream();
    file << image.id.value << ' ' << q.w() << ' ' << q.x() << ' ' << q.y() << ' ' << q.z() << ' '
         << t.x() << ' ' << t.y() << ' ' << t.z() << ' ' << image.camera.value << ' '
         << ColmapName(image.name) << '\n';
    bool is_first = true;
    for (const ColmapFeature& feature : image.features) {
      file << (is_first ? "" : " ") << feature.x_px << ' ' << feature.y_px << ' ';
      if (feature.point != 0) {
        file << feature.point;
      } else {
        file << -1;
      }
      is_first = false;
    }
    file << '\n';
  }

  void AddPoint(uint64_t number, const PointRecord& point) override {
    std::ostream& file = points_.stream();
    file << number << ' ' << point.position.x() << ' ' << point.position.y() << ' '
         << point.position.z();
    for (const uint8_t channel : point.rgb) file << ' ' << static_cast<int>(channel);
    file << ' ' << point.error_px;
    for (const TrackElement& element : point.track)
      file << ' ' << element.image.value << ' ' << element.feature;
    file << '\n';
  }

  Status Finish() override {
    for (OutputFile* file : {&cameras_, &images_, &points_}) VEDUTA_RETURN_IF_ERROR(file->Close());
    return Status::Ok();
  }

 private:
  OutputFile cameras_, images_, points_;
};

}  // namespace

Result<std::unique_ptr<ColmapFiles>> OpenColmapText(const std::string& folder) {
  auto files = std::make_unique<ColmapText>(folder);
  VEDUTA_RETURN_IF_ERROR(files->Check());
  return Result<std::unique_ptr<ColmapFiles>>(std::move(files));
}

}  // namespace veduta
