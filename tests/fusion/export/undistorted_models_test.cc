// SPDX-License-Identifier: Apache-2.0
// Goal: models with undistorted photos say where these photos see the points: scene.mvs of OpenMVS,
//   field by field as its header has them, and COLMAP's binary model in sparse/0.
// Method: a street, whose camera is given a lens after its photos were placed; the files are read
//   by readers of the published formats, and the points projected by what stands in them alone. The
//   features are where an undistorted photo has them.
#include "fusion/export/undistorted_photos.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

#include "engine/camera/photo_header.h"
#include "fusion/export/exporter.h"
#include "fusion/export/told_scene.h"
#include "storage/base/whole_file.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

class Bytes {
 public:
  explicit Bytes(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    EXPECT_TRUE(file) << path;
    bytes_ = {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }
  template <typename Number>
  Number Take() {
    Number value{};
    EXPECT_LE(at_ + sizeof(value), bytes_.size());
    if (at_ + sizeof(value) > bytes_.size()) return value;
    std::memcpy(&value, bytes_.data() + at_, sizeof(value));
    at_ += sizeof(value);
    return value;
  }
  std::string Text(uint64_t size) {
    EXPECT_LE(at_ + size, bytes_.size());
    const std::string text = bytes_.substr(at_, size);
    at_ += text.size();
    return text;
  }
  std::string TextToZero() {
    const std::string text = bytes_.substr(at_, bytes_.find('\0', at_) - at_);
    at_ += text.size() + 1;
    return text;
  }
  Eigen::Matrix3d Matrix() {
    Eigen::Matrix3d matrix;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) matrix(row, column) = Take<double>();
    }
    return matrix;
  }
  Eigen::Vector3d Vector() {
    const double x = Take<double>(), y = Take<double>();
    return {x, y, Take<double>()};
  }
  bool AtEnd() const { return at_ == bytes_.size(); }

 private:
  std::string bytes_;
  size_t at_ = 0;
};

// How far from the features, px, the cameras see each vertex in the photos that it names.
std::vector<double> ErrorsOfVertices(uint64_t count, const std::vector<Eigen::Matrix3d>& k,
                                     const std::vector<Rigid3>& poses,
                                     const std::vector<std::pair<ImageId, Eigen::Vector2d>>& seen,
                                     Bytes* file) {
  std::vector<double> errors;
  for (uint64_t i = 0; i < count; ++i) {
    const float x = file->Take<float>(), y = file->Take<float>(), z = file->Take<float>();
    const auto views = file->Take<uint64_t>();
    EXPECT_TRUE(views >= 2 && views <= 4);
    for (uint64_t v = 0; v < views && v < 4; ++v) {
      const auto view = file->Take<uint32_t>();
      EXPECT_EQ(file->Take<float>(), 0);
      const Eigen::Vector3d px = k.at(view) * (poses.at(view) * Eigen::Vector3d(x, y, z));
      EXPECT_GT(px.z(), 0);
      double nearest = 1e9;
      for (const auto& [image, place] : seen) {
        if (image.value == view + 1) nearest = std::min(nearest, (px.hnormalized() - place).norm());
      }
      errors.push_back(nearest);
    }
  }
  return errors;
}

class UndistortedModels : public testing::Test {
 protected:
  void SetUp() override {
    city_.Add({{20.0, 90}, {20.7, 90}, {21.4, 90}, {22.1, 90}});
    SetLens(-0.2);
  }
  void SetLens(double k1) {
    const auto transaction = city_.parts().database->BeginTransaction();
    CameraRecord camera = *city_.parts().database->GetSnapshot()->GetCamera(CameraId(1));
    camera.model.k1 = k1;
    transaction->PutCamera(camera);
    ASSERT_OK(transaction->Commit());
  }

  std::string Export(const std::string& format) {
    const std::string folder = folder_.path() + "/" + format;
    const auto models = ExportReconstructions(city_.Ask().snapshot(), {folder, format});
    EXPECT_OK(models);
    EXPECT_EQ(models->front().images, 4u);
    EXPECT_GT(models->front().points, 100u);
    return folder + "/0";
  }

  // Where the images see their points, px.
  std::vector<std::pair<ImageId, Eigen::Vector2d>> Seen() {
    const CityQuestions ask = city_.Ask();
    std::vector<std::pair<ImageId, Eigen::Vector2d>> seen;
    for (uint32_t id = 1; id <= 4; ++id) {
      const ImageRecord image = *ask.snapshot().GetImage(ImageId(id));
      const Features features = *ask.snapshot().GetFeatures(image.photo);
      for (const Observation& observation : *ask.snapshot().GetObservations(image.id)) {
        const Keypoint& k = features.keypoints[observation.feature];
        seen.push_back({image.id, {k.x_px, k.y_px}});
      }
    }
    return seen;
  }

  City city_;
  TemporaryFolder folder_;
};

TEST_F(UndistortedModels, OpenMvsReadsItsScene) {
  const std::string folder = Export("openmvs");
  Bytes file(folder + "/scene.mvs");
  EXPECT_EQ(file.Text(4), "MVSI");
  EXPECT_EQ(file.Take<uint32_t>(), 2u);
  EXPECT_EQ(file.Take<uint32_t>(), 0u);
  ASSERT_EQ(file.Take<uint64_t>(), 4u);
  std::vector<Eigen::Matrix3d> k;
  std::vector<Rigid3> poses;
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(file.Text(file.Take<uint64_t>()), "platform");
    ASSERT_EQ(file.Take<uint64_t>(), 1u);
    EXPECT_EQ(file.Text(file.Take<uint64_t>()), "camera");
    EXPECT_EQ(file.Take<uint32_t>(), 512u);
    EXPECT_EQ(file.Take<uint32_t>(), 384u);
    k.push_back(file.Matrix());
    EXPECT_EQ(file.Matrix(), Eigen::Matrix3d::Identity());
    EXPECT_EQ(file.Vector(), Eigen::Vector3d::Zero());
    ASSERT_EQ(file.Take<uint64_t>(), 1u);
    const Eigen::Quaterniond rotation(file.Matrix());
    const Eigen::Vector3d center = file.Vector();
    poses.push_back({rotation, -(rotation * center)});
  }
  EXPECT_EQ(k[0](0, 0), 450);
  EXPECT_EQ(k[0](0, 2), 255.5) << "the centre of a pixel is a whole number";
  ASSERT_EQ(file.Take<uint64_t>(), 4u);
  for (uint32_t i = 0; i < 4; ++i) {
    EXPECT_TRUE(std::filesystem::exists(folder + "/" + file.Text(file.Take<uint64_t>())));
    EXPECT_EQ(file.Take<uint32_t>(), i);
    EXPECT_EQ(file.Take<uint32_t>(), 0u);
    EXPECT_EQ(file.Take<uint32_t>(), 0u);
  }
  const auto count = file.Take<uint64_t>();
  ASSERT_GT(count, 100u);
  std::vector<double> errors = ErrorsOfVertices(count, k, poses, Seen(), &file);
  std::ranges::sort(errors);
  EXPECT_LT(errors[errors.size() / 2], 0.7);
  EXPECT_LT(errors.back(), 6);
  EXPECT_EQ(file.Take<uint64_t>(), 0u);
  ASSERT_EQ(file.Take<uint64_t>(), count);
  for (uint64_t i = 0; i < 3 * count; ++i) file.Take<uint8_t>();
  for (int i = 0; i < 3; ++i) EXPECT_EQ(file.Take<uint64_t>(), 0u);
  for (int i = 0; i < 16; ++i) EXPECT_EQ(file.Take<double>(), i % 5 == 0 ? 1 : 0);
  EXPECT_TRUE(file.AtEnd());
}

// How far each feature of a model in COLMAP's binary files lies from its point, px. All images have
// the camera 1, of these parameters.
std::vector<double> ErrorsOfFeatures(const std::string& folder, double f, double cx, double cy) {
  std::map<uint64_t, Eigen::Vector3d> positions;
  Bytes points(folder + "/sparse/0/points3D.bin");
  for (auto left = points.Take<uint64_t>(); left > 0; --left) {
    const auto number = points.Take<uint64_t>();
    positions[number] = points.Vector();
    points.Text(3);
    points.Take<double>();
    points.Text(8 * points.Take<uint64_t>());
  }
  EXPECT_TRUE(points.AtEnd());
  Bytes images(folder + "/sparse/0/images.bin");
  EXPECT_EQ(images.Take<uint64_t>(), 4u);
  std::vector<double> errors;
  for (int i = 0; i < 4; ++i) {
    images.Take<uint32_t>();
    const double w = images.Take<double>();
    const Eigen::Vector3d xyz = images.Vector();
    const Rigid3 pose{Eigen::Quaterniond(w, xyz.x(), xyz.y(), xyz.z()), images.Vector()};
    EXPECT_EQ(images.Take<uint32_t>(), 1u);
    EXPECT_TRUE(std::filesystem::exists(folder + "/images/" + images.TextToZero()));
    for (auto left = images.Take<uint64_t>(); left > 0; --left) {
      const double x = images.Take<double>(), y = images.Take<double>();
      const auto number = images.Take<uint64_t>();
      if (number == ~0ull) continue;
      const Eigen::Vector2d seen = (pose * positions.at(number)).hnormalized();
      errors.push_back(std::hypot(f * seen.x() + cx - x, f * seen.y() + cy - y));
    }
  }
  EXPECT_TRUE(images.AtEnd());
  std::ranges::sort(errors);
  return errors;
}

TEST_F(UndistortedModels, ColmapsModelIsOfPinholes) {
  const std::string folder = Export("colmap-undistorted");
  Bytes cameras(folder + "/sparse/0/cameras.bin");
  ASSERT_EQ(cameras.Take<uint64_t>(), 1u);
  EXPECT_EQ(cameras.Take<uint32_t>(), 1u);
  EXPECT_EQ(cameras.Take<int32_t>(), 1) << "PINHOLE";
  EXPECT_EQ(cameras.Take<uint64_t>(), 512u);
  EXPECT_EQ(cameras.Take<uint64_t>(), 384u);
  for (const double wanted : {450.0, 450.0, 256.0, 192.0})
    EXPECT_EQ(cameras.Take<double>(), wanted);
  EXPECT_TRUE(cameras.AtEnd());
  const std::vector<double> errors = ErrorsOfFeatures(folder, 450, 256, 192);
  ASSERT_GT(errors.size(), 400u);
  EXPECT_LT(errors[errors.size() / 2], 0.7);
  EXPECT_LT(errors.back(), 6);
}

// Where the undistorted photo ends within the photo's size it is cropped.
TEST_F(UndistortedModels, ColmapsCamerasFitCroppedPhotos) {
  SetLens(0.1);
  const std::string folder = Export("colmap-undistorted");
  Bytes cameras(folder + "/sparse/0/cameras.bin");
  EXPECT_EQ(cameras.Take<uint64_t>(), 1u);
  cameras.Take<uint32_t>();
  cameras.Take<int32_t>();
  const auto width = cameras.Take<uint64_t>(), height = cameras.Take<uint64_t>();
  EXPECT_LT(width, 500u);
  const auto bytes = ReadWholeFile(folder + "/images/000001.png", 1 << 22);
  ASSERT_OK(bytes);
  const PhotoHeader header =
      ReadPhotoHeader({reinterpret_cast<const uint8_t*>(bytes->data()), bytes->size()});
  EXPECT_EQ(header.stored_size,
            (ImageSize{static_cast<uint32_t>(width), static_cast<uint32_t>(height)}));
  EXPECT_EQ(cameras.Take<double>(), 450);
  cameras.Take<double>();
  const double cx = cameras.Take<double>(), cy = cameras.Take<double>();
  EXPECT_NEAR(cx, static_cast<double>(width) / 2, 1);
  EXPECT_NEAR(cy, static_cast<double>(height) / 2, 1);
  const std::vector<double> errors = ErrorsOfFeatures(folder, 450, cx, cy);
  ASSERT_GT(errors.size(), 400u);
  EXPECT_LT(errors[errors.size() / 2], 0.7);
}

TEST_F(UndistortedModels, AFolderThatCannotBeMadeIsNamed) {
  const auto scene = LoadToldScene(city_.Ask().snapshot(), ReconstructionId(1));
  ASSERT_OK(scene);
  const auto failed = WriteUndistorted(city_.Ask().snapshot(), *scene, "/no such folder");
  EXPECT_EQ(failed.status().code(), StatusCode::kIoError);
  EXPECT_NE(failed.status().message().find("/no such folder/images"), std::string::npos);
  const CityQuestions ask = city_.Ask();
  const auto record = ask.snapshot().GetReconstruction(ReconstructionId(1));
  ASSERT_OK(record);
  const auto scene_failed =
      MakeOpenMvsExporter(ask.snapshot(), {})->Write(*record, "/no such folder");
  EXPECT_EQ(scene_failed.status().message(), failed.status().message());
}

}  // namespace
}  // namespace veduta
