// SPDX-License-Identifier: Apache-2.0
// Goal: every format writes the living reconstructions, largest first, into folders of their own,
//   and refuses what it cannot do, naming it.
// Method: a street of a few photos in a real database, written in every format with and without a
//   surface; a second, larger reconstruction by hand for the order; bad requests one by one.
#include "fusion/export/exporter.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <set>
#include <sstream>

#include "engine/camera/orientation.h"
#include "fusion/export/told_scene.h"
#include "fusion/pass/dense_pass.h"
#include "storage/records/photo_record.h"
#include "tests/engine/street_fixture.h"
#include "tests/fusion/surface/glb_reader.h"
#include "tests/storage/damage.h"

namespace veduta {
namespace {

std::set<std::string> FilesIn(const std::string& folder) {
  std::set<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    EXPECT_GT(entry.file_size(), 0u) << entry.path();
    names.insert(entry.path().filename().string());
  }
  return names;
}

class ExporterTest : public testing::Test {
 protected:
  void SetUp() override { city_.Add({{20.0, 90}, {20.7, 90}, {21.4, 90}, {22.1, 90}}); }

  Result<std::vector<ExportedModel>> Export(const std::string& folder, const std::string& format,
                                            double error_max = 0) {
    return ExportReconstructions(city_.Ask().snapshot(),
                                 {folder_.path() + "/" + folder, format, error_max});
  }

  City city_;
  TemporaryFolder folder_;
};

TEST_F(ExporterTest, WritesEveryFormatBeforeThereIsASurfaceAndAfter) {
  const std::vector<std::string> formats = ExportFormats();
  ASSERT_EQ(formats, (std::vector<std::string>{"colmap", "colmap-binary", "colmap-undistorted",
                                               "nerfstudio", "openmvs", "ply", "gltf"}));
  for (const std::string& format : formats) {
    const auto models = Export("sparse-" + format, format);
    ASSERT_OK(models);
    ASSERT_EQ(models->size(), 1u) << format;
    EXPECT_EQ(models->front().images, 4u);
    EXPECT_GT(models->front().points, 100u);
    EXPECT_EQ(models->front().triangles, 0u);
    EXPECT_EQ(models->front().may_have_surface, format == "ply" || format == "gltf") << format;
    EXPECT_EQ(models->front().folder, folder_.path() + "/sparse-" + format + "/0");
  }
  EXPECT_EQ(FilesIn(folder_.path() + "/sparse-colmap/0"),
            (std::set<std::string>{"cameras.txt", "images.txt", "points3D.txt"}));
  EXPECT_EQ(FilesIn(folder_.path() + "/sparse-colmap-binary/0"),
            (std::set<std::string>{"cameras.bin", "images.bin", "points3D.bin"}));
  EXPECT_TRUE(std::filesystem::exists(folder_.path() + "/sparse-nerfstudio/0/transforms.json"));
  EXPECT_EQ(FilesIn(folder_.path() + "/sparse-colmap-undistorted/0/sparse/0"),
            (std::set<std::string>{"cameras.bin", "images.bin", "points3D.bin"}));
  EXPECT_EQ(FilesIn(folder_.path() + "/sparse-colmap-undistorted/0/images"),
            (std::set<std::string>{"000001.png", "000002.png", "000003.png", "000004.png"}));
  EXPECT_TRUE(std::filesystem::exists(folder_.path() + "/sparse-openmvs/0/scene.mvs"));
  EXPECT_EQ(FilesIn(folder_.path() + "/sparse-ply/0"),
            (std::set<std::string>{"cameras.json", "cameras.ply", "points.ply"}));
  EXPECT_EQ(FilesIn(folder_.path() + "/sparse-gltf/0"), (std::set<std::string>{"model.glb"}));

  DensifyOptions options;
  options.depth_side_px = 96;
  const auto dense = RunDensePass({*city_.parts().writer, *city_.parts().pool, nullptr, {}, {}},
                                  ReconstructionId(1), options);
  ASSERT_OK(dense);
  const auto ply = Export("ply", "ply"), coarse = Export("coarse", "ply", dense->voxel_size / 2),
             gltf = Export("gltf", "gltf");
  ASSERT_OK(ply);
  ASSERT_OK(coarse);
  ASSERT_OK(gltf);
  EXPECT_TRUE(FilesIn(folder_.path() + "/ply/0").contains("mesh.ply"));
  EXPECT_GT(ply->front().triangles, 100u);
  EXPECT_LT(coarse->front().triangles, ply->front().triangles);
  EXPECT_EQ(gltf->front().triangles, ply->front().triangles);
}

std::string FileText(const std::string& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

TEST_F(ExporterTest, DamagedFeaturesAreComputedAgain) {
  ASSERT_OK(Export("whole", "colmap"));
  const auto image = city_.Ask().snapshot().GetImage(ImageId(2));
  ASSERT_OK(image);
  city_.Close();
  WithRocksdb(
      city_.path(),
      [&](rocksdb::DB& db, rocksdb::ColumnFamilyHandle* handle) {
        ASSERT_TRUE(db.Put({}, handle, HashKey(image->photo), "damaged").ok());
      },
      Family::kFeatures);
  city_.Open();
  ASSERT_OK(Export("damaged", "colmap"));
  EXPECT_EQ(FileText(folder_.path() + "/whole/0/images.txt"),
            FileText(folder_.path() + "/damaged/0/images.txt"));
}

TEST_F(ExporterTest, LivingReconstructionsComeLargestFirst) {
  const auto first = city_.Ask().snapshot().GetReconstruction(ReconstructionId(1));
  ASSERT_OK(first);
  const auto transaction = city_.parts().database->BeginTransaction();
  ReconstructionRecord other = *first;
  other.id = ReconstructionId(5);
  other.image_count = first->image_count + 3;
  transaction->PutReconstruction(other);
  other.id = ReconstructionId(6);
  other.image_count = first->image_count;
  transaction->PutReconstruction(other);
  other.id = ReconstructionId(7);
  other.image_count = first->image_count + 9;
  other.merged_into = ReconstructionId(1);
  transaction->PutReconstruction(other);
  ASSERT_OK(transaction->Commit());
  const auto models = Export("order", "colmap");
  ASSERT_OK(models);
  std::vector<uint32_t> ids;
  for (const ExportedModel& model : *models) ids.push_back(model.reconstruction.value);
  EXPECT_EQ(ids, (std::vector<uint32_t>{5, 1, 6}));
}

// The tokens of a line, divided as COLMAP's reader does
// (src/colmap/scene/reconstruction_io_text.cc).
std::vector<std::string> ColmapTokens(const std::string& line) {
  std::vector<std::string> tokens;
  std::istringstream stream(line);
  for (std::string token; std::getline(stream, token, ' ');) tokens.push_back(token);
  return tokens;
}

TEST_F(ExporterTest, ColmapReadsEveryNameBack) {
  Database& database = *city_.parts().database;
  const std::pair<std::string, std::string> names[] = {
      {"a b\nc.jpg", "a%20b%0Ac.jpg"},
      {"a%20b.jpg", "a%2520b.jpg"},
      {" #\x7f.jpg\r", "%20#%7F.jpg%0D"},
      {"gut \xc3\xa9/\xe9.jpg", "gut%20\xc3\xa9/\xe9.jpg"}};
  const auto transaction = database.BeginTransaction();
  for (uint32_t id = 1; id <= 4; ++id) {
    auto image = database.GetSnapshot()->GetImage(ImageId(id));
    ASSERT_OK(image);
    image->name = names[id - 1].first;
    transaction->PutImage(*image);
  }
  ASSERT_OK(transaction->Commit());
  const auto models = Export("names", "colmap");
  ASSERT_OK(models);
  std::ifstream file(models->front().folder + "/images.txt");
  size_t read = 0;
  for (std::string line, points; std::getline(file, line);) {
    if (line[0] == '#') continue;
    std::getline(file, points);
    const std::vector<std::string> tokens = ColmapTokens(line);
    ASSERT_EQ(tokens.size(), 10u) << line;
    EXPECT_EQ(tokens[9], names[std::stoul(tokens[0]) - 1].second);
    ++read;
  }
  EXPECT_EQ(read, 4u);
}

// The numbers of the images in the tracks of a model's points.
std::vector<std::multiset<uint64_t>> ColmapTracks(const std::string& path) {
  std::vector<std::multiset<uint64_t>> tracks;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line[0] == '#') continue;
    const std::vector<std::string> tokens = ColmapTokens(line);
    std::multiset<uint64_t>& track = tracks.emplace_back();
    for (size_t i = 8; i + 1 < tokens.size(); i += 2) track.insert(std::stoull(tokens[i]));
  }
  return tracks;
}

TEST_F(ExporterTest, WhoMayStandElsewhereIsLeftOut) {
  const auto all = Export("all", "colmap");
  ASSERT_OK(all);
  HypothesisRecord hypothesis;
  hypothesis.a = ReconstructionId(1);
  hypothesis.b = ReconstructionId(2);
  hypothesis.reason = RefusalReason::kContradicted;
  hypothesis.images = {ImageId(1), ImageId(4)};
  hypothesis.unsure = {ImageId(4)};
  const auto transaction = city_.parts().database->BeginTransaction();
  transaction->PutHypothesis(hypothesis);
  ASSERT_OK(transaction->Commit());
  for (const std::string& format : ExportFormats()) {
    const auto models = Export(format, format);
    ASSERT_OK(models);
    EXPECT_EQ(models->front().images, 3u) << format;
  }
  const auto scene = LoadToldScene(city_.Ask().snapshot(), ReconstructionId(1));
  ASSERT_OK(scene);
  EXPECT_FALSE(scene->images.contains(ImageId(4)));
  const auto tracks = ColmapTracks(folder_.path() + "/colmap/0/points3D.txt");
  EXPECT_LT(tracks.size(), all->front().points);
  EXPECT_GT(tracks.size(), 100u);
  for (const std::multiset<uint64_t>& track : tracks) {
    EXPECT_GE(track.size(), 2u);
    EXPECT_EQ(track.count(4), 0u);
  }
}

TEST_F(ExporterTest, ANameOfSeveralIsToldByItsContributor) {
  Database& database = *city_.parts().database;
  const auto transaction = database.BeginTransaction();
  for (uint32_t id = 1; id <= 2; ++id) {
    auto image = database.GetSnapshot()->GetImage(ImageId(id));
    ASSERT_OK(image);
    image->name = "IMG_1.jpg";
    image->contributor = id == 1 ? "anna" : "bert";
    transaction->PutImage(*image);
  }
  ASSERT_OK(transaction->Commit());
  const std::pair<const char*, const char*> files[] = {
      {"colmap", "/images.txt"}, {"nerfstudio", "/transforms.json"}, {"ply", "/cameras.json"}};
  for (const auto& [format, name] : files) {
    const auto models = Export(format, format);
    ASSERT_OK(models);
    std::ifstream file(models->front().folder + name);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    EXPECT_NE(text.find("anna/IMG_1.jpg"), std::string::npos) << format;
    EXPECT_NE(text.find("bert/IMG_1.jpg"), std::string::npos) << format;
  }
}

// Photos that a camera has as they lie in their files hang in the world the other way round; what
// is up stays up.
TEST_F(ExporterTest, UpIsThatOfThePhotosUpright) {
  const auto root = [&](const std::string& folder) {
    EXPECT_OK(Export(folder, "gltf"));
    const GlbFile file(folder_.path() + "/" + folder + "/0/model.glb");
    const auto& turn = file.json["nodes"][0]["rotation"];
    return Eigen::Quaterniond(turn[3], turn[0], turn[1], turn[2]);
  };
  const Eigen::Quaterniond upright = root("upright");
  Database& database = *city_.parts().database;
  for (const int orientation : {6, 8, 3}) {
    const auto snapshot = database.GetSnapshot();
    const auto transaction = database.BeginTransaction();
    for (uint32_t id = 1; id <= 4; ++id) {
      auto image = snapshot->GetImage(ImageId(id));
      auto pose = snapshot->FindPose(ImageId(id));
      ASSERT_OK(image);
      ASSERT_OK(pose);
      const Eigen::Quaterniond before(UprightCamFromStoredCam(image->orientation)),
          now(UprightCamFromStoredCam(orientation));
      (*pose)->cam_from_world =
          Rigid3{now.conjugate() * before, Eigen::Vector3d::Zero()} * (*pose)->cam_from_world;
      image->orientation = static_cast<uint8_t>(orientation);
      transaction->PutImage(*image);
      transaction->PutPose(**pose);
    }
    ASSERT_OK(transaction->Commit());
    const Eigen::Quaterniond lying = root("lying" + std::to_string(orientation));
    EXPECT_LT(lying.angularDistance(upright), 1e-6) << orientation;
  }
}

TEST_F(ExporterTest, RefusesByName) {
  EXPECT_EQ(Export("out", "obj").status().code(), StatusCode::kInvalidArgument);
  EXPECT_NE(Export("out", "obj")
                .status()
                .message()
                .find("colmap, colmap-binary, colmap-undistorted, nerfstudio, openmvs, "
                      "ply, gltf"),
            std::string::npos);
  EXPECT_EQ(Export("out", "ply", -1).status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(ExportRequest().Check().code(), StatusCode::kInvalidArgument) << "no folder";
  std::filesystem::create_directories(folder_.path() + "/full/x");
  EXPECT_EQ(Export("full", "colmap").status().code(), StatusCode::kAlreadyExists);
  std::ofstream(folder_.path() + "/file") << "in the way";
  EXPECT_FALSE(Export("file/out", "ply").ok());
}

}  // namespace
}  // namespace veduta
