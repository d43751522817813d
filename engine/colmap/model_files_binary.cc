// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <bit>
#include <filesystem>
#include <fstream>
#include <type_traits>
#include <vector>

#include "engine/colmap/model_files.h"

namespace veduta {
namespace {

static_assert(std::endian::native == std::endian::little, "COLMAP's files are little-endian");

// COLMAP's numbers of its lenses (src/colmap/sensor/models.h), with how many parameters each has.
struct Lens {
  const char* name;
  size_t parameter_count;
};
constexpr std::array<Lens, 11> kLenses = {{{"SIMPLE_PINHOLE", 3},
                                           {"PINHOLE", 4},
                                           {"SIMPLE_RADIAL", 4},
                                           {"RADIAL", 5},
                                           {"OPENCV", 8},
                                           {"OPENCV_FISHEYE", 8},
                                           {"FULL_OPENCV", 12},
                                           {"FOV", 5},
                                           {"SIMPLE_RADIAL_FISHEYE", 4},
                                           {"RADIAL_FISHEYE", 5},
                                           {"THIN_PRISM_FISHEYE", 12}}};

// Takes little-endian numbers from the front of a file. What is taken beyond its end is 0, and
// `is_cut_off` from then on.
class BinaryFile final {
 public:
  static Result<BinaryFile> Open(const std::string& path) {
    std::error_code failure;
    if (!std::filesystem::exists(path, failure))
      return Status::NotFound(path + " is missing: a model is cameras, images and points3D");
    if (!std::filesystem::is_regular_file(path, failure))
      return Status::InvalidArgument(path + " is not a file");
    const uintmax_t size = std::filesystem::file_size(path, failure);
    BinaryFile file;
    file.stream_.open(path, std::ios::binary);
    if (failure || !file.stream_) return Status::IoError("cannot read " + path);
    file.path_ = path;
    file.left_ = size;
    return file;
  }

  template <typename Number>
  Number Take() {
    static_assert(std::is_arithmetic_v<Number>);
    Number value{};
    if (!Claim(sizeof(value))) return value;
    stream_.read(reinterpret_cast<char*>(&value), sizeof(value));
    return value;
  }
  // Up to a zero byte, which is taken as well; of a longer name the first bytes.
  std::string TakeName() {
    std::string name;
    while (name.size() <= kModelNameBytesMax) {
      const char byte = Take<char>();
      if (byte == 0) break;
      name += byte;
    }
    return name;
  }
  void Skip(uint64_t bytes) {
    if (Claim(bytes)) stream_.seekg(static_cast<std::streamoff>(bytes), std::ios::cur);
  }

  // How many records follow, which have `bytes_min` each at least.
  Result<uint64_t> TakeCount(uint64_t bytes_min, uint64_t count_max) {
    const auto count = Take<uint64_t>();
    VEDUTA_RETURN_IF_ERROR(Check());
    if (count > count_max || count > left_ / bytes_min) {
      return Wrong("it says that it has " + std::to_string(count) + " records, and has " +
                   std::to_string(left_) + " bytes; at most " + std::to_string(count_max) +
                   " are read");
    }
    return count;
  }
  Status Check() const {
    if (is_cut_off_) return Wrong("it is cut off");
    return stream_ ? Status::Ok() : Status::IoError("cannot read " + path_);
  }
  Status Wrong(const std::string& what) const {
    return Status::InvalidArgument(path_ + ": " + what);
  }
  // What a receiver has said, with the file's name.
  Status Told(const Status& status) const {
    return status.ok() ? status : Status(status.code(), path_ + ": " + status.message());
  }
  uint64_t left() const { return left_; }

 private:
  bool Claim(uint64_t bytes) {
    is_cut_off_ = is_cut_off_ || bytes > left_;
    if (is_cut_off_) return false;
    left_ -= bytes;
    return true;
  }

  std::string path_;
  std::ifstream stream_;
  uint64_t left_ = 0;
  bool is_cut_off_ = false;
};

// camera_id int32, model_id int32, width uint64, height uint64, params double[].
Status ReadCameras(const std::string& folder, const ModelReceiver& receiver) {
  VEDUTA_ASSIGN_OR_RETURN(BinaryFile file, BinaryFile::Open(folder + "/cameras.bin"));
  VEDUTA_ASSIGN_OR_RETURN(const uint64_t count, file.TakeCount(48, kModelCamerasMax));
  for (uint64_t i = 0; i < count; ++i) {
    const auto id = file.Take<uint32_t>();
    const auto lens = file.Take<uint32_t>();
    const auto width_px = static_cast<double>(file.Take<uint64_t>());
    const auto height_px = static_cast<double>(file.Take<uint64_t>());
    VEDUTA_RETURN_IF_ERROR(file.Check());
    const std::string which = "camera " + std::to_string(id);
    if (lens >= kLenses.size())
      return file.Wrong(which + " has lens number " + std::to_string(lens) + ", which is unknown");
    std::vector<double> parameters(kLenses[lens].parameter_count);
    for (double& parameter : parameters) parameter = file.Take<double>();
    VEDUTA_RETURN_IF_ERROR(file.Check());
    const Result<KnownColmapCamera> camera =
        MakeColmapCamera(id, kLenses[lens].name, width_px, height_px, parameters);
    if (!camera.ok()) return file.Wrong(which + ": " + camera.status().message());
    VEDUTA_RETURN_IF_ERROR(file.Told(receiver.camera(*camera)));
  }
  return Status::Ok();
}

// image_id uint32, qvec double[4] (w first), tvec double[3], camera_id uint32, name with a zero
// byte, the number of features uint64, of each x double, y double, point3D_id uint64.
Status ReadImages(const std::string& folder, const ModelReceiver& receiver) {
  constexpr uint64_t kFeatureBytes = 24;
  VEDUTA_ASSIGN_OR_RETURN(BinaryFile file, BinaryFile::Open(folder + "/images.bin"));
  VEDUTA_ASSIGN_OR_RETURN(const uint64_t count, file.TakeCount(73, kModelImagesMax));
  for (uint64_t i = 0; i < count; ++i) {
    ImageRow image;
    image.id = file.Take<uint32_t>();
    for (double& number : image.pose) number = file.Take<double>();
    image.camera = file.Take<uint32_t>();
    image.name = file.TakeName();
    const auto features = file.Take<uint64_t>();
    VEDUTA_RETURN_IF_ERROR(file.Check());
    if (image.name.size() <= kModelNameBytesMax) {  // otherwise the receiver refuses it
      if (features > file.left() / kFeatureBytes) return file.Wrong("it is cut off");
      file.Skip(features * kFeatureBytes);
    }
    VEDUTA_RETURN_IF_ERROR(file.Told(receiver.image(std::move(image))));
  }
  return file.Check();
}

// point3D_id uint64, xyz double[3], rgb uint8[3], error double, the track's length uint64, of each
// element image_id uint32, point2D_idx uint32.
Status ReadPoints(const std::string& folder, const ModelReceiver& receiver) {
  constexpr uint64_t kBeforeTrack = 8 + 24 + 3 + 8, kElementBytes = 8;
  VEDUTA_ASSIGN_OR_RETURN(BinaryFile file, BinaryFile::Open(folder + "/points3D.bin"));
  VEDUTA_ASSIGN_OR_RETURN(const uint64_t count, file.TakeCount(kBeforeTrack + 8, UINT64_MAX));
  std::vector<uint32_t> track;
  for (uint64_t i = 0; i < count; ++i) {
    file.Skip(kBeforeTrack);
    const auto length = file.Take<uint64_t>();
    // A point is seen once in an image at most.
    if (length > kModelImagesMax || length > file.left() / kElementBytes)
      return file.Wrong("a track has " + std::to_string(length) + " elements, and the rest has " +
                        std::to_string(file.left()) + " bytes");
    track.clear();
    for (uint64_t element = 0; element < length; ++element) {
      track.push_back(file.Take<uint32_t>());
      file.Skip(4);
    }
    VEDUTA_RETURN_IF_ERROR(file.Check());
    VEDUTA_RETURN_IF_ERROR(file.Told(receiver.track(track)));
  }
  return Status::Ok();
}

}  // namespace

Status ReadBinaryFiles(const std::string& folder, const ModelReceiver& receiver) {
  VEDUTA_RETURN_IF_ERROR(ReadCameras(folder, receiver));
  VEDUTA_RETURN_IF_ERROR(ReadImages(folder, receiver));
  return ReadPoints(folder, receiver);
}

}  // namespace veduta
