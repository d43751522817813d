// SPDX-License-Identifier: Apache-2.0
// Goal: COLMAP's binary files say exactly what the text files say, byte for byte as the published
//   format has them, with names as they are; a file that cannot be written is named.
// Method: a model made by hand is written and read back by a reader of the published format
//   (https://colmap.github.io/format.html); a street is exported in both formats, and the two are
//   compared number by number.
#include "fusion/export/colmap_files.h"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "fusion/export/exporter.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

std::string FileText(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  EXPECT_TRUE(file) << path;
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

// Takes little-endian numbers from the front of a file.
class Bytes {
 public:
  explicit Bytes(const std::string& path) : bytes_(FileText(path)) {}

  template <typename Number>
  Number Take() {
    Number value{};
    EXPECT_LE(at_ + sizeof(value), bytes_.size());
    if (at_ + sizeof(value) > bytes_.size()) return value;
    std::memcpy(&value, bytes_.data() + at_, sizeof(value));
    at_ += sizeof(value);
    return value;
  }
  std::string TakeName() {
    const std::string name(bytes_.c_str() + at_);
    at_ += name.size() + 1;
    return name;
  }
  bool IsAtEnd() const { return at_ == bytes_.size(); }

 private:
  const std::string bytes_;
  size_t at_ = 0;
};

// What a model's three files hold, each record as the numbers and names of the text format.
struct Records {
  std::vector<std::vector<std::string>> cameras, images, points;
};

template <typename Number>
std::string Text(Number value) {
  std::ostringstream text;
  text.precision(17);
  text << value;
  return text.str();
}

Records ReadBinary(const std::string& folder) {
  Records records;
  Bytes cameras(folder + "/cameras.bin");
  for (uint64_t n = cameras.Take<uint64_t>(); n > 0; --n) {
    std::vector<std::string> row = {Text(cameras.Take<int32_t>())};
    const int32_t model = cameras.Take<int32_t>();
    EXPECT_TRUE(model == 1 || model == 4) << model;
    row.push_back(model == 1 ? "PINHOLE" : "OPENCV");
    for (int i = 0; i < 2; ++i) row.push_back(Text(cameras.Take<uint64_t>()));
    for (int i = 0; i < (model == 1 ? 4 : 8); ++i) row.push_back(Text(cameras.Take<double>()));
    records.cameras.push_back(row);
  }
  EXPECT_TRUE(cameras.IsAtEnd());
  Bytes images(folder + "/images.bin");
  for (uint64_t n = images.Take<uint64_t>(); n > 0; --n) {
    std::vector<std::string> row = {Text(images.Take<uint32_t>())};
    for (int i = 0; i < 7; ++i) row.push_back(Text(images.Take<double>()));
    row.push_back(Text(images.Take<uint32_t>()));
    row.push_back(images.TakeName());
    for (uint64_t f = images.Take<uint64_t>(); f > 0; --f) {
      for (int i = 0; i < 2; ++i) row.push_back(Text(images.Take<double>()));
      row.push_back(Text(images.Take<int64_t>()));  // -1: no point
    }
    records.images.push_back(row);
  }
  EXPECT_TRUE(images.IsAtEnd());
  Bytes points(folder + "/points3D.bin");
  for (uint64_t n = points.Take<uint64_t>(); n > 0; --n) {
    std::vector<std::string> row = {Text(points.Take<uint64_t>())};
    for (int i = 0; i < 3; ++i) row.push_back(Text(points.Take<double>()));
    for (int i = 0; i < 3; ++i) row.push_back(Text(int{points.Take<uint8_t>()}));
    row.push_back(Text(points.Take<double>()));
    for (uint64_t t = points.Take<uint64_t>(); t > 0; --t) {
      for (int i = 0; i < 2; ++i) row.push_back(Text(points.Take<uint32_t>()));
    }
    records.points.push_back(row);
  }
  EXPECT_TRUE(points.IsAtEnd());
  return records;
}

// `lines` lines make a record.
std::vector<std::vector<std::string>> ReadRows(const std::string& path, int lines) {
  std::vector<std::vector<std::string>> rows;
  std::ifstream file(path);
  int line_number = 0;
  for (std::string line; std::getline(file, line);) {
    if (!line.empty() && line[0] == '#') continue;
    if (line_number++ % lines == 0) rows.emplace_back();
    std::istringstream words(line);
    for (std::string word; words >> word;) rows.back().push_back(word);
  }
  return rows;
}

Records ReadText(const std::string& folder) {
  return {ReadRows(folder + "/cameras.txt", 1), ReadRows(folder + "/images.txt", 2),
          ReadRows(folder + "/points3D.txt", 1)};
}

void WriteModel(ColmapFiles* files) {
  PointRecord point;
  point.position = {1, -2, 0.1};
  point.rgb = {0, 128, 255};
  point.error_px = 0.5;
  point.track = {{ImageId(7), 1}, {ImageId(9), 0}};
  files->AddPoint(1, point);
  ColmapImage image;
  image.id = ImageId(7);
  image.camera = CameraId(2);
  image.name = "a b/100%.jpg";
  image.cam_from_world = {Eigen::Quaterniond(0.5, -0.5, 0.5, 0.5), {0.1, 2, -3}};
  image.features = {{1.5, 2.25, 0}, {100.5, 1e-3, 1}};
  files->AddImage(image);
  image.id = ImageId(9);
  image.name = "c.jpg";
  image.features = {{3, 4, 1}};
  files->AddImage(image);
  files->AddCamera({CameraId(2),
                    ColmapCameraModel::kOpenCv,
                    640,
                    480,
                    {500, 501, 320.5, 240.5, -0.1, 0.02, 0, 0}});
  files->AddCamera({CameraId(3), ColmapCameraModel::kPinhole, 64, 48, {50, 51, 32, 24}});
  EXPECT_OK(files->Finish());
}

TEST(ColmapFiles, AModelByHandIsReadBack) {
  const TemporaryFolder folder;
  auto binary = OpenColmapBinary(folder.path());
  ASSERT_OK(binary);
  WriteModel(binary->get());
  const Records read = ReadBinary(folder.path());
  ASSERT_EQ(read.cameras.size(), 2u);
  EXPECT_EQ(read.cameras[0],
            (std::vector<std::string>{"2", "OPENCV", "640", "480", "500", "501", "320.5", "240.5",
                                      Text(-0.1), Text(0.02), "0", "0"}));
  EXPECT_EQ(read.cameras[1],
            (std::vector<std::string>{"3", "PINHOLE", "64", "48", "50", "51", "32", "24"}));
  ASSERT_EQ(read.images.size(), 2u);
  EXPECT_EQ(read.images[0], (std::vector<std::string>{"7", "0.5", "-0.5", "0.5", "0.5", Text(0.1),
                                                      "2", "-3", "2", "a b/100%.jpg", "1.5", "2.25",
                                                      "-1", "100.5", Text(1e-3), "1"}));
  ASSERT_EQ(read.points.size(), 1u);
  EXPECT_EQ(read.points[0], (std::vector<std::string>{"1", "1", "-2", Text(0.1), "0", "128", "255",
                                                      "0.5", "7", "1", "9", "0"}));
  auto text = OpenColmapText(folder.path());
  ASSERT_OK(text);
  WriteModel(text->get());
  Records told = ReadText(folder.path());
  EXPECT_EQ(told.images[0][9], "a%20b/100%25.jpg");
  told.images[0][9] = "a b/100%.jpg";
  EXPECT_EQ(told.cameras, read.cameras);
  EXPECT_EQ(told.images, read.images);
  EXPECT_EQ(told.points, read.points);
}

TEST(ColmapFiles, AStreetIsTheSameInBothFormats) {
  City city;
  city.Add({{20.0, 90}, {20.7, 90}, {21.4, 90}, {22.1, 90}});
  const TemporaryFolder folder;
  for (const std::string format : {"colmap", "colmap-binary"}) {
    const auto models =
        ExportReconstructions(city.Ask().snapshot(), {folder.path() + "/" + format, format, 0});
    ASSERT_OK(models);
    ASSERT_EQ(models->size(), 1u);
  }
  const Records text = ReadText(folder.path() + "/colmap/0");
  const Records binary = ReadBinary(folder.path() + "/colmap-binary/0");
  ASSERT_EQ(binary.images.size(), 4u);
  EXPECT_GT(binary.points.size(), 100u);
  EXPECT_EQ(text.cameras, binary.cameras);
  EXPECT_EQ(text.images, binary.images);
  ASSERT_EQ(text.points.size(), binary.points.size());
  for (size_t i = 0; i < text.points.size(); ++i) {
    // The error is a float, which the text rounds to the digits of a float.
    std::vector<std::string> a = text.points[i], b = binary.points[i];
    EXPECT_FLOAT_EQ(std::stof(a[7]), std::stof(b[7]));
    a[7] = b[7];
    EXPECT_EQ(a, b);
  }
}

TEST(ColmapFiles, WhatCannotBeWrittenIsNamed) {
  const TemporaryFolder folder;
  for (const auto open : {OpenColmapText, OpenColmapBinary}) {
    const auto files = open(folder.path() + "/nowhere");
    EXPECT_EQ(files.status().code(), StatusCode::kIoError);
    EXPECT_NE(files.status().message().find("nowhere/cameras."), std::string::npos);
  }
  // A disk that is full.
  std::filesystem::create_symlink("/dev/full", folder.path() + "/points3D.bin");
  auto files = OpenColmapBinary(folder.path());
  ASSERT_OK(files);
  for (uint64_t i = 1; i < 100'000; ++i) (*files)->AddPoint(i, PointRecord());
  const Status finished = (*files)->Finish();
  EXPECT_EQ(finished.code(), StatusCode::kIoError);
  EXPECT_NE(finished.message().find("points3D.bin"), std::string::npos) << finished.message();
}

}  // namespace
}  // namespace veduta
