// SPDX-License-Identifier: Apache-2.0
#include <bit>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>

#include "fusion/export/colmap_files.h"
#include "fusion/export/output_file.h"

namespace veduta {
namespace {

static_assert(std::endian::native == std::endian::little, "COLMAP's files are little-endian");

// What a feature without a point has for one (kInvalidPoint3DId in COLMAP).
constexpr uint64_t kNoPoint = std::numeric_limits<uint64_t>::max();

// A file that begins with the number of its records, which is known at its end.
class CountedFile final {
 public:
  explicit CountedFile(std::string path) : file_(std::move(path)) { Put<uint64_t>(0); }

  template <typename Number>
  void Put(Number value) {
    static_assert(std::is_arithmetic_v<Number>);
    PutBytes(&value, sizeof(value));
  }
  void PutBytes(const void* bytes, size_t count) {
    file_.stream().write(static_cast<const char*>(bytes), static_cast<std::streamsize>(count));
  }
  void CountRecord() { ++count_; }

  Status Check() const { return file_.Check(); }
  Status Close() {
    file_.stream().seekp(0);
    Put(count_);
    return file_.Close();
  }

 private:
  OutputFile file_;
  uint64_t count_ = 0;
};

class ColmapBinary final : public ColmapFiles {
 public:
  explicit ColmapBinary(const std::string& folder)
      : cameras_(folder + "/cameras.bin"),
        images_(folder + "/images.bin"),
        points_(folder + "/points3D.bin") {}

  Status Check() const {
    for (const CountedFile* file : {&cameras_, &images_, &points_})
      VEDUTA_RETURN_IF_ERROR(file->Check());
    return Status::Ok();
  }

  // camera_id int32, model_id int32, width uint64, height uint64, params double[].
  void AddCamera(const ColmapCamera& camera) override {
    cameras_.CountRecord();
    cameras_.Put<uint32_t>(camera.id.value);
    cameras_.Put<int32_t>(static_cast<int32_t>(camera.model));
    cameras_.Put(camera.width_px);
    cameras_.Put(camera.height_px);
    for (const double value : camera.params) cameras_.Put(value);
  }

  // image_id uint32, qvec double[4] (w first), tvec double[3], camera_id uint32, name with a zero
  // byte, the number of features uint64, of each x double, y double, point3D_id uint64.
  void AddImage(const ColmapImage& image) override {
    const Eigen::Quaterniond& q = image.cam_from_world.rotation;
    const Eigen::Vector3d& t = image.cam_from_world.translation;
    images_.CountRecord();
    images_.Put<uint32_t>(image.id.value);
    for (const double value : {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()}) images_.Put(value);
    images_.Put<uint32_t>(image.camera.value);
    images_.PutBytes(image.name.c_str(), std::strlen(image.name.c_str()) + 1);
    images_.Put<uint64_t>(image.features.size());
    for (const ColmapFeature& feature : image.features) {
      images_.Put(feature.x_px);
      images_.Put(feature.y_px);
      images_.Put(feature.point != 0 ? feature.point : kNoPoint);
    }
  }

  // point3D_id uint64, xyz double[3], rgb uint8[3], error double, the track's length uint64, of
  // each element image_id uint32, point2D_idx uint32.
  void AddPoint(uint64_t number, const PointRecord& point) override {
    points_.CountRecord();
    points_.Put(number);
    for (Eigen::Index i = 0; i < 3; ++i) points_.Put(point.position[i]);
    for (const uint8_t channel : point.rgb) points_.Put(channel);
    points_.Put<double>(point.error_px);
    points_.Put<uint64_t>(point.track.size());
    for (const TrackElement& element : point.track) {
      points_.Put<uint32_t>(element.image.value);
      points_.Put<uint32_t>(element.feature);
    }
  }

  Status Finish() override {
    for (CountedFile* file : {&cameras_, &images_, &points_}) VEDUTA_RETURN_IF_ERROR(file->Close());
    return Status::Ok();
  }

 private:
  CountedFile cameras_, images_, points_;
};

}  // namespace

Result<std::unique_ptr<ColmapFiles>> OpenColmapBinary(const std::string& folder) {
  auto files = std::make_unique<ColmapBinary>(folder);
  VEDUTA_RETURN_IF_ERROR(files->Check());
  return Result<std::unique_ptr<ColmapFiles>>(std::move(files));
}

}  // namespace veduta
