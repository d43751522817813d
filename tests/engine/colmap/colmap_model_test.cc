// SPDX-License-Identifier: Apache-2.0
// Goal: a model of COLMAP is read as it is meant, binary and text alike, and nothing that a file
//   says makes reading it do harm: each damage is an error that names the file.
// Method: a model made by hand is written by the published format
//   (https://colmap.github.io/format.html) and read back; then its files are cut off at every byte,
//   changed at random, and given single absurd values.
#include "engine/colmap/colmap_model.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>

namespace veduta {
namespace {

class Bytes {
 public:
  template <typename Number>
  Bytes& Put(Number value) {
    text_.append(reinterpret_cast<const char*>(&value), sizeof(value));
    return *this;
  }
  Bytes& PutName(const std::string& name) {
    text_ += name;
    text_ += '\0';
    return *this;
  }
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

struct Files {
  std::string cameras, images, points;
};

struct Row {
  uint32_t id;
  double qw;
  double tx;
  uint32_t camera;
  std::string name;
};

std::string BinaryImages(const std::vector<Row>& rows) {
  Bytes bytes;
  bytes.Put<uint64_t>(rows.size());
  for (const Row& row : rows) {
    bytes.Put(row.id).Put(row.qw);
    for (const double number : {0.0, 0.0, 0.0, row.tx, 2.0, 3.0}) bytes.Put(number);
    bytes.Put(row.camera).PutName(row.name).Put<uint64_t>(2);
    for (const double x : {1.5, 7.25}) bytes.Put(x).Put(x).Put<uint64_t>(9);
  }
  return bytes.text();
}

std::string BinaryCamera(uint32_t lens, const std::vector<double>& parameters) {
  Bytes bytes;
  bytes.Put<uint64_t>(1).Put<uint32_t>(3).Put(lens).Put<uint64_t>(640).Put<uint64_t>(480);
  for (const double parameter : parameters) bytes.Put(parameter);
  return bytes.text();
}

const std::vector<Row> kRows = {
    {7, 1, 0.5, 3, "b/a photo, 50%.jpg"}, {2, -1, 1, 3, "a.jpg"}, {5, 1, 2, 3, "c.jpg"}};

Files BinaryModel() {
  Files files;
  files.cameras = BinaryCamera(3, {500, 320, 240, -0.1, 0.02});
  files.images = BinaryImages(kRows);
  // 7 and 2 share two points, 7 and 5 one; 99 is no image.
  const std::vector<std::vector<uint32_t>> tracks = {{7, 2}, {2, 7, 5}, {99, 5}};
  Bytes points;
  points.Put<uint64_t>(tracks.size());
  for (const std::vector<uint32_t>& track : tracks) {
    points.Put<uint64_t>(1);
    for (int i = 0; i < 3; ++i) points.Put(1.0);
    for (int i = 0; i < 3; ++i) points.Put<uint8_t>(1);
    points.Put(0.5).Put<uint64_t>(track.size());
    for (const uint32_t image : track) points.Put(image).Put<uint32_t>(4);
  }
  files.points = points.text();
  return files;
}

Files TextModel() {
  return {"# a comment\n3 RADIAL 640 480 500 320 240 -0.1 0.02\n",
          "# a comment\n7 1 0 0 0 0.5 2 3 3 b/a photo, 50%.jpg\n1.5 1.5 9 7.25 7.25 -1\n"
          "2 -1 0 0 0 1 2 3 3 a.jpg\r\n\n5 1 0 0 0 2 2 3 3 c.jpg\n",
          "# a comment\n1 1 1 1 1 1 1 0.5 7 4 2 4\n2 1 1 1 1 1 1 0.5 2 4 7 4 5 4\n"
          "3 1 1 1 1 1 1 0.5 99 4 5 4\n"};
}

class ColmapModelTest : public testing::Test {
 protected:
  ColmapModelTest()
      : folder_(testing::TempDir() + "veduta_colmap_model_" + std::to_string(getpid())) {
    Clear();
  }
  ~ColmapModelTest() override { std::filesystem::remove_all(folder_); }

  void Clear() {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void Write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ + "/" + name, std::ios::binary) << bytes;
  }
  Result<ColmapModel> Read(const Files& files, const std::string& ending) const {
    Write("cameras" + ending, files.cameras);
    Write("images" + ending, files.images);
    Write("points3D" + ending, files.points);
    return ReadColmapModel(folder_);
  }
  // That reading fails, by a fault of the file that `named` names.
  void ExpectRefused(const Files& files, const std::string& ending, const std::string& named) {
    const Result<ColmapModel> model = Read(files, ending);
    ASSERT_FALSE(model.ok()) << named;
    EXPECT_EQ(model.status().code(), StatusCode::kInvalidArgument);
    EXPECT_NE(model.status().message().find(named), std::string::npos) << model.status().message();
  }

  const std::string folder_;
};

void ExpectAsMeant(const Result<ColmapModel>& model) {
  ASSERT_TRUE(model.ok()) << model.status().message();
  ASSERT_EQ(model->cameras.size(), 1u);
  EXPECT_EQ(model->cameras[0].id, 3u);
  EXPECT_EQ(model->cameras[0].lens, "RADIAL");
  EXPECT_EQ(model->cameras[0].model,
            (CameraModel{640, 480, 500, 500, 319.5, 239.5, -0.1, 0.02, 319.5, 239.5}));
  ASSERT_EQ(model->images.size(), 3u);
  EXPECT_EQ(model->images[0].name, "a.jpg");
  EXPECT_EQ(model->images[1].name, "c.jpg");
  EXPECT_EQ(model->images[2].name, "b/a photo, 50%.jpg");
  EXPECT_EQ(model->images[2].id, 7u);
  EXPECT_EQ(model->images[2].cam_from_world.translation, Eigen::Vector3d(0.5, 2, 3));
  EXPECT_EQ(model->images[0].cam_from_world.rotation.w(), -1);
  EXPECT_TRUE(model->images[0].seen_with.empty());
  EXPECT_EQ(model->images[1].seen_with, std::vector<uint32_t>{0});
  EXPECT_EQ(model->images[2].seen_with, (std::vector<uint32_t>{0, 1}));
}

TEST_F(ColmapModelTest, BinaryAndTextSayTheSame) {
  ExpectAsMeant(Read(TextModel(), ".txt"));
  ExpectAsMeant(Read(BinaryModel(), ".bin"));  // which comes first where both are there
}

TEST_F(ColmapModelTest, OneInCoordinatesOfAMapIsMovedNear) {
  const Eigen::Vector3d far(533400, 5213040, 350);
  Files files = TextModel();
  // No rotation: centres are the translations, negative.
  files.images =
      "7 1 0 0 0 -533400.5 -5213040 -350 3 a.jpg\n\n2 1 0 0 0 -533401 -5213042 -350 3 b.jpg\n\n"
      "5 0 1 0 0 -533410 5213040 350 3 c.jpg\n\n";
  const auto model = Read(files, ".txt");
  ASSERT_TRUE(model.ok()) << model.status().message();
  EXPECT_EQ(model->origin, Eigen::Vector3d(533401, 5213040, 350));
  const Eigen::Vector3d turned = model->images[1].cam_from_world.Center() + model->origin;
  EXPECT_LT((turned - Eigen::Vector3d(533410, 5213040, 350)).norm(), 1e-6);
  EXPECT_EQ(model->images[2].cam_from_world.translation, Eigen::Vector3d(0.5, 0, 0));
  EXPECT_TRUE(Read(TextModel(), ".txt")->origin.isZero()) << "it begins beside its photos";
}

TEST_F(ColmapModelTest, ACutFileIsRefusedAtEveryByte) {
  const Files whole = BinaryModel();
  for (std::string Files::*const file : {&Files::cameras, &Files::images, &Files::points}) {
    for (size_t length = 0; length < (whole.*file).size(); ++length) {
      Files cut = whole;
      (cut.*file).resize(length);
      const Result<ColmapModel> model = Read(cut, ".bin");
      ASSERT_FALSE(model.ok()) << length;
      EXPECT_EQ(model.status().code(), StatusCode::kInvalidArgument) << model.status().message();
      EXPECT_NE(model.status().message().find(".bin"), std::string::npos);
    }
  }
}

TEST_F(ColmapModelTest, AMissingFileIsNamed) {
  EXPECT_EQ(ReadColmapModel(folder_).status().code(), StatusCode::kNotFound);
  EXPECT_EQ(ReadColmapModel(folder_ + "/none").status().code(), StatusCode::kNotFound);
  Write("cameras.bin", BinaryModel().cameras);
  EXPECT_NE(ReadColmapModel(folder_).status().message().find("images.bin is missing"),
            std::string::npos);
  std::filesystem::create_directories(folder_ + "/images.bin");
  EXPECT_NE(ReadColmapModel(folder_).status().message().find("not a file"), std::string::npos);
}

TEST_F(ColmapModelTest, AbsurdCountsAreRefusedBeforeTheyAreBelieved) {
  for (const uint64_t count : {uint64_t{4}, uint64_t{1} << 40, ~uint64_t{0}}) {
    Files files = BinaryModel();
    std::memcpy(files.images.data(), &count, sizeof(count));
    ExpectRefused(files, ".bin", "images.bin");
    files = BinaryModel();
    std::memcpy(files.points.data(), &count, sizeof(count));
    ExpectRefused(files, ".bin", "points3D.bin");
    files = BinaryModel();
    std::memcpy(files.points.data() + 8 + 43, &count, sizeof(count));  // of the first track
    ExpectRefused(files, ".bin", "points3D.bin");
    files = BinaryModel();
    const size_t features = 8 + 4 + 56 + 4 + kRows[0].name.size() + 1;
    std::memcpy(files.images.data() + features, &count, sizeof(count));
    ExpectRefused(files, ".bin", "images.bin");
  }
}

TEST_F(ColmapModelTest, AbsurdRecordsAreRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto with = [](Row row) {
    Files files = BinaryModel();
    files.images = BinaryImages({row, kRows[1]});
    return files;
  };
  ExpectRefused(with({7, nan, 0, 3, "x"}), ".bin", "finite");
  ExpectRefused(with({7, 0, 0, 3, "x"}), ".bin", "unit length");
  ExpectRefused(with({7, 1, INFINITY, 3, "x"}), ".bin", "finite");
  ExpectRefused(with({7, 1, 1e12, 3, "x"}), ".bin", "1e9");
  ExpectRefused(with({7, 1, 0, 4, "x"}), ".bin", "camera 4");
  ExpectRefused(with({2, 1, 0, 3, "x"}), ".bin", "image 2 is there twice");
  ExpectRefused(with({7, 1, 0, 3, "a.jpg"}), ".bin", "the name of another one");
  ExpectRefused(with({7, 1, 0, 3, ""}), ".bin", "no name");
  ExpectRefused(with({7, 1, 0, 3, std::string(5000, 'x')}), ".bin", "4096");
  Files text = TextModel();
  std::filesystem::remove(folder_ + "/cameras.bin");
  text.images = "7 nan 0 0 0 0 0 0 3 x\n\n";
  ExpectRefused(text, ".txt", "images.txt, line 1");
  text.images = "7 1 0 0 0 0 0 3\n\n";
  ExpectRefused(text, ".txt", "images.txt, line 1");
  text = TextModel();
  text.points = "1 1 1 1 1 1 1 0.5 7\n";
  ExpectRefused(text, ".txt", "points3D.txt, line 1");
  text.points = "1 1 1\n";
  ExpectRefused(text, ".txt", "points3D.txt, line 1");
}

TEST_F(ColmapModelTest, ALensThatOursCannotExpressIsRefusedWithWhatToDo) {
  Files files = BinaryModel();
  files.cameras = BinaryCamera(5, {500, 500, 320, 240, 0, 0, 0, 0});
  ExpectRefused(files, ".bin", "camera 3: the model 'OPENCV_FISHEYE' is not one of");
  files.cameras = BinaryCamera(40, {500, 320, 240});
  ExpectRefused(files, ".bin", "lens number 40");
  files.cameras = BinaryCamera(4, {500, 500, 320, 240, -0.1, 0.02, 0.2, 0.2});
  ExpectRefused(files, ".bin", "image_undistorter");
  files.cameras = BinaryCamera(4, {500, 500, 320, 240, -0.1, 0.02, 0.0005, 0});
  EXPECT_TRUE(Read(files, ".bin").ok());  // nearly: a centre of its own
  files.cameras = BinaryCamera(1, {500, 510, 320, 240});
  EXPECT_TRUE(Read(files, ".bin").ok());
}

TEST_F(ColmapModelTest, NoChangeOfBytesDoesHarm) {
  std::mt19937 random(7);
  for (const auto& [whole, ending] :
       {std::pair(BinaryModel(), ".bin"), std::pair(TextModel(), ".txt")}) {
    Clear();
    size_t refused = 0;
    for (int i = 0; i < 200; ++i) {
      Files files = whole;
      std::string Files::*const file =
          std::array{&Files::cameras, &Files::images, &Files::points}[random() % 3];
      for (uint32_t changes = 1 + random() % 3; changes > 0; --changes)
        (files.*file)[random() % (files.*file).size()] = static_cast<char>(random());
      const Result<ColmapModel> model = Read(files, ending);
      refused += !model.ok();
      if (!model.ok()) continue;
      for (const ModelImage& image : model->images) {
        EXPECT_TRUE(image.cam_from_world.translation.allFinite());
        EXPECT_NEAR(image.cam_from_world.rotation.norm(), 1, 1e-12);
      }
    }
    EXPECT_GT(refused, 25u) << ending;
  }
}

}  // namespace
}  // namespace veduta
