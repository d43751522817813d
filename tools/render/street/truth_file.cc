// SPDX-License-Identifier: Apache-2.0
#include "tools/render/street/truth_file.h"

#include <cstring>
#include <fstream>
#include <iomanip>
#include <sstream>

namespace veduta::street {
namespace {

constexpr char kDepthMagic[4] = {'V', 'D', 'P', '1'};
constexpr uint32_t kSizeMax = 8192;

std::string Number(double value) {
  std::ostringstream text;
  text << std::setprecision(15) << value;
  return text.str();
}

}  // namespace

Status WriteCameraFile(const StreetCamera& camera, const std::string& path) {
  std::ofstream file(path);
  file << std::setprecision(15);
  const CameraModel& m = camera.model;
  file << m.fx << " 0 " << m.cx << "\n0 " << m.fy << " " << m.cy << "\n0 0 1\n0 0 0\n";
  const Eigen::Matrix3d world_from_cam =
      camera.cam_from_world.rotation.toRotationMatrix().transpose();
  for (int r = 0; r < 3; ++r) {
    file << world_from_cam(r, 0) << " " << world_from_cam(r, 1) << " " << world_from_cam(r, 2)
         << "\n";
  }
  const Eigen::Vector3d center = camera.cam_from_world.Center();
  file << center.x() << " " << center.y() << " " << center.z() << "\n"
       << m.width_px << " " << m.height_px << "\n";
  file.close();
  if (!file) return Status::IoError("cannot write " + path);
  return {};
}

Result<StreetCamera> ReadCameraFile(const std::string& path) {
  std::ifstream file(path);
  if (!file) return Status::IoError("cannot read " + path);
  double values[26];
  for (double& value : values) {
    if (!(file >> value))
      return Status::Corruption(path + " is not a camera file: 26 numbers expected");
  }
  StreetCamera camera;
  CameraModel& m = camera.model;
  m.fx = values[0];
  m.cx = m.u0 = values[2];
  m.fy = values[4];
  m.cy = m.v0 = values[5];
  const Eigen::Matrix3d world_from_cam =
      Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(values + 12);
  if (!(world_from_cam * world_from_cam.transpose()).isIdentity(1e-6) ||
      world_from_cam.determinant() < 0) {
    return Status::Corruption(path + " holds a matrix that is no rotation");
  }
  if (!(values[24] >= 1 && values[24] <= 1e6 && values[25] >= 1 && values[25] <= 1e6)) {
    return Status::Corruption(path + " holds an impossible photo size");
  }
  m.width_px = static_cast<uint32_t>(values[24]);
  m.height_px = static_cast<uint32_t>(values[25]);
  const Eigen::Vector3d center(values[21], values[22], values[23]);
  camera.cam_from_world.rotation =
      Eigen::Quaterniond(Eigen::Matrix3d(world_from_cam.transpose())).normalized();
  camera.cam_from_world.translation = -(camera.cam_from_world.rotation * center);
  return camera;
}

Status WriteDepthFile(const StreetPhoto& photo, const std::string& path) {
  if (photo.depth.size() != size_t{photo.width_px} * photo.height_px) {
    return Status::InvalidArgument("a photo without depth was to be written to " + path);
  }
  std::ofstream file(path, std::ios::binary);
  const uint32_t size[2] = {photo.width_px, photo.height_px};
  file.write(kDepthMagic, sizeof kDepthMagic);
  file.write(reinterpret_cast<const char*>(size), sizeof size);
  file.write(reinterpret_cast<const char*>(photo.depth.data()),
             static_cast<std::streamsize>(photo.depth.size() * sizeof(float)));
  file.close();
  if (!file) return Status::IoError("cannot write " + path);
  return {};
}

Result<DepthMap> ReadDepthFile(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return Status::IoError("cannot read " + path);
  char magic[4];
  uint32_t size[2];
  if (!file.read(magic, sizeof magic) || std::memcmp(magic, kDepthMagic, sizeof magic) != 0 ||
      !file.read(reinterpret_cast<char*>(size), sizeof size) || size[0] > kSizeMax ||
      size[1] > kSizeMax) {
    return Status::Corruption(path + " is not a depth file");
  }
  DepthMap map = {size[0], size[1], std::vector<float>(size_t{size[0]} * size[1])};
  if (!file.read(reinterpret_cast<char*>(map.depth.data()),
                 static_cast<std::streamsize>(map.depth.size() * sizeof(float)))) {
    return Status::Corruption(path + " is cut short");
  }
  return map;
}

std::string CameraParams(const CameraModel& m) {
  std::string text;
  for (const double value : {m.fx, m.fy, m.cx, m.cy, m.k1, m.k2, m.u0, m.v0}) {
    text += (text.empty() ? "" : ",") + Number(value);
  }
  return text;
}

Status WriteIntrinsicsFile(const CameraModel& m, const std::string& path) {
  std::ofstream file(path);
  file << "PINHOLE " << m.width_px << " " << m.height_px << " fx " << Number(m.fx) << " fy "
       << Number(m.fy) << " cx " << Number(m.cx) << " cy " << Number(m.cy) << "\nDISTORTION k1 "
       << Number(m.k1) << " k2 " << Number(m.k2) << " u0 " << Number(m.u0) << " v0 " << Number(m.v0)
       << "\nPARAMS " << CameraParams(m) << "\n";
  file.close();
  if (!file) return Status::IoError("cannot write " + path);
  return {};
}

Result<CameraModel> ReadIntrinsicsFile(const std::string& path) {
  std::ifstream file(path);
  if (!file) return Status::IoError("cannot read " + path);
  CameraModel m;
  std::string word[9];
  file >> word[0] >> m.width_px >> m.height_px >> word[1] >> m.fx >> word[2] >> m.fy >> word[3] >>
      m.cx >> word[4] >> m.cy;
  if (!file || word[0] != "PINHOLE")
    return Status::Corruption(path + " is not a camera's intrinsics");
  m.u0 = m.cx;
  m.v0 = m.cy;
  if (file >> word[0] && word[0] == "DISTORTION" &&
      !(file >> word[5] >> m.k1 >> word[6] >> m.k2 >> word[7] >> m.u0 >> word[8] >> m.v0)) {
    return Status::Corruption(path + " has a broken line DISTORTION");
  }
  return m;
}

}  // namespace veduta::street
