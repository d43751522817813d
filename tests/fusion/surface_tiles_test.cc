// SPDX-License-Identifier: Apache-2.0
// Goal: the stored surface of a city can be asked for as a tileset: all of it, coarse and fine, by
//   names that stand for the same bytes for ever; what changes is another tileset.
// Method: a street of a few photos in a real database after a dense pass; every content is fetched
//   and read by a reader of glTF of its own; then another pass, a place on the earth, damage.
#include "fusion/surface_tiles.h"

#include <functional>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "engine/earth/local_frame.h"
#include "tests/engine/street_fixture.h"
#include "tests/fusion/surface/glb_reader.h"
#include "tests/storage/stored_families.h"

namespace veduta {
namespace {

using Json = nlohmann::json;

constexpr ReconstructionId kFirst(1);

class SurfaceTilesTest : public testing::Test {
 protected:
  void SetUp() override { city_.Add({{20.0, 90}, {20.7, 90}, {21.4, 90}, {22.1, 90}}); }

  DensifyReport Densify(double voxel_factor = 1) {
    DensifyRequest request;
    request.device = "cpp";
    request.options.depth_side_px = 96;
    request.options.voxel_px = 0.7;  // of some more tiles
    if (voxel_ > 0) request.options.voxel_size = voxel_factor * voxel_;
    const auto reports = city_.engine().Densify(request);
    EXPECT_OK(reports);
    voxel_ = reports->front().voxel_size;
    return reports->front();
  }

  Json Tileset() {
    const auto tileset = city_.engine().Ask().Tileset(kFirst);
    EXPECT_OK(tileset);
    return tileset.ok() ? Json::parse(tileset->json) : Json();
  }

  Result<std::vector<uint8_t>> Content(const Json& node) {
    const std::string uri = node["content"]["uri"];
    const std::string name = uri.substr(6, uri.size() - 6 - 4);
    EXPECT_EQ(uri, "tiles/" + name + ".glb");
    VEDUTA_ASSIGN_OR_RETURN(SurfaceTileAnswer tile, city_.engine().Ask().SurfaceTile(kFirst, name));
    left_out_ = tile.left_out;
    return std::move(tile.glb);
  }

  static void Visit(const Json& node, const std::function<void(const Json&)>& visit) {
    visit(node);
    if (!node.contains("children")) return;
    for (const Json& child : node["children"]) Visit(child, visit);
  }

  City city_;
  double voxel_ = 0;
  std::vector<std::string> left_out_;  // of the last content
};

void ExpectInBox(const GlbFile& file, const Json& node) {
  const auto& box = node["boundingVolume"]["box"];
  const auto& translation = file.json["nodes"][0]["translation"];
  const auto& primitive = file.json["meshes"][0]["primitives"][0];
  for (const auto& position : file.Read(primitive["attributes"]["POSITION"])) {
    std::array<double, 3> y_up{};
    for (size_t k = 0; k < 3; ++k) y_up[k] = position[k] + translation[k].get<double>();
    const std::array<double, 3> x = {y_up[0], -y_up[2], y_up[1]};
    for (size_t k = 0; k < 3; ++k) {
      EXPECT_LE(std::abs(x[k] - box[k].get<double>()), box[3 + 4 * k].get<double>() + 1e-6)
          << node["content"];
    }
  }
}

size_t TrianglesOf(const GlbFile& file) {
  if (!file.json.contains("meshes")) return 0;
  return file.json["accessors"][file.json["meshes"][0]["primitives"][0]["indices"].get<size_t>()]
                  ["count"]
                      .get<size_t>() /
         3;
}

TEST_F(SurfaceTilesTest, AllOfTheSurfaceIsThereCoarseAndFine) {
  const DensifyReport report = Densify();
  ASSERT_GT(report.tiles, 4u);
  const Json tileset = Tileset();
  size_t leaves = 0, triangles = 0, root_triangles = 0;
  Visit(tileset["root"], [&](const Json& node) {
    const auto bytes = Content(node);
    ASSERT_OK(bytes);
    const GlbFile file(*bytes);
    if (file.json.contains("meshes")) ExpectInBox(file, node);
    if (node == tileset["root"]) root_triangles = TrianglesOf(file);
    if (node.contains("children")) {
      for (const Json& child : node["children"])
        EXPECT_LT(child["geometricError"].get<double>(), node["geometricError"].get<double>());
    } else {
      ++leaves;
      triangles += TrianglesOf(file);
    }
    EXPECT_EQ(*Content(node), *bytes) << "the same bytes again";
  });
  EXPECT_EQ(triangles, report.triangles);
  EXPECT_GT(leaves, 4u);
  EXPECT_LE(leaves, report.tiles);
  EXPECT_GT(root_triangles, 100u);
  EXPECT_LT(root_triangles, triangles / 4);
}

TEST_F(SurfaceTilesTest, TheSameSurfaceIsTheSameTilesetAlsoWhenItIsMadeAnew) {
  Densify();
  const Json tileset = Tileset();
  const auto before = Content(tileset["root"]);
  ASSERT_OK(before);
  const std::string tag = city_.engine().Ask().Tileset(kFirst)->tag;
  city_.Reopen();  // nothing is kept
  EXPECT_EQ(city_.engine().Ask().Tileset(kFirst)->tag, tag);
  EXPECT_EQ(*Content(tileset["root"]), *before);
}

TEST_F(SurfaceTilesTest, ManyThreadsMayAskAtOnce) {
  Densify();
  std::vector<Json> nodes;
  std::vector<std::vector<uint8_t>> expected;
  Visit(Tileset()["root"], [&](const Json& node) {
    nodes.push_back(node);
    expected.push_back(*Content(node));
  });
  city_.Reopen();  // nothing is kept
  std::vector<std::jthread> threads;
  for (size_t first = 0; first < 6; ++first) {
    threads.emplace_back([&, first] {
      for (size_t i = 0; i < nodes.size(); ++i) {
        const size_t at = (first / 2 * 5 + i) % nodes.size();  // two of each begin at the same one
        EXPECT_EQ(*Content(nodes[at]), expected[at]);
      }
    });
  }
}

TEST_F(SurfaceTilesTest, AnotherSurfaceHasOtherNames) {
  Densify();
  const Json old_tileset = Tileset();
  ASSERT_OK(Content(old_tileset["root"]));
  Densify(1.5);
  const Json tileset = Tileset();
  EXPECT_NE(tileset, old_tileset);
  Visit(old_tileset["root"], [&](const Json& node) {
    if (node.contains("children")) return;
    EXPECT_EQ(Content(node).status().code(), StatusCode::kNotFound);
  });
  Visit(tileset["root"], [&](const Json& node) { EXPECT_OK(Content(node)); });
}

TEST_F(SurfaceTilesTest, NothingOfAPhotoThatWasRemovedIsLeft) {
  Densify();
  const Json old_tileset = Tileset();
  Visit(old_tileset["root"], [&](const Json& node) { ASSERT_OK(Content(node)); });
  RemoveRequest request;
  request.photos = {"#2"};
  request.actor = "anna";
  ASSERT_OK(city_.engine().Remove(request));
  size_t gone = 0;
  Visit(old_tileset["root"], [&](const Json& node) { gone += Content(node).ok() ? 0 : 1; });
  EXPECT_GT(gone, 0u);
  EXPECT_EQ(Content(old_tileset["root"]).status().code(), StatusCode::kNotFound)
      << "what was kept of it is forgotten";
}

TEST_F(SurfaceTilesTest, SaysWhyThereIsNone) {
  const Questions ask = city_.engine().Ask();
  const auto none = ask.Tileset(kFirst);
  EXPECT_EQ(none.status().code(), StatusCode::kNotFound);
  EXPECT_NE(none.status().message().find("veduta densify"), std::string::npos);
  EXPECT_EQ(ask.Tileset(ReconstructionId(9)).status().code(), StatusCode::kNotFound);
  const std::string name = "0_0_0_0_0123456789abcdef";
  EXPECT_EQ(ask.SurfaceTile(kFirst, name).status().code(), StatusCode::kNotFound);
  Densify();
  const Questions now = city_.engine().Ask();
  for (const char* text : {"", "..", "0_0_0_0_0123456789abcdef", "5_0_0_0_0123456789abcdef",
                           "99_0_0_0_0123456789abcdef", "0_0_0_0", "tileset.json"})
    EXPECT_EQ(now.SurfaceTile(kFirst, text).status().code(), StatusCode::kNotFound) << text;
}

TEST_F(SurfaceTilesTest, StandsWhereTheCityIsOnTheEarth) {
  Densify();
  EXPECT_FALSE(Tileset()["root"].contains("transform"));
  const std::string tag = city_.engine().Ask().Tileset(kFirst)->tag;
  EarthPlace place;
  place.origin = {47.07, 15.44, 350};
  place.enu_from_world.scale = 3;
  place.enu_from_world.translation = {10, 20, 30};
  {
    Writer::Turn turn = city_.parts().writer->Take();
    auto record = turn.database().GetSnapshot()->GetReconstruction(kFirst);
    ASSERT_OK(record);
    const auto transaction = turn.database().BeginTransaction();
    record->georeference.version = 1;
    record->georeference.place = place;
    transaction->PutReconstruction(*record);
    ASSERT_OK(transaction->Commit());
  }
  const Json tileset = Tileset();
  EXPECT_NE(city_.engine().Ask().Tileset(kFirst)->tag, tag);
  const auto& transform = tileset["root"]["transform"];
  const auto column = [&](size_t c) {
    return Eigen::Vector3d(transform[4 * c], transform[4 * c + 1], transform[4 * c + 2]);
  };
  const Eigen::Vector3d x(1, 2, 0.5);
  const Eigen::Vector3d earth = column(0) * x[0] + column(1) * x[1] + column(2) * x[2] + column(3);
  const GeoPosition told = LocalFrame(place.origin).ToGeo(place.enu_from_world * x);
  const Eigen::Vector3d expected = LocalFrame(told).EcefFromEnu().topRightCorner<3, 1>();
  EXPECT_LT((earth - expected).norm(), 1e-6);
  EXPECT_OK(Content(tileset["root"]));
}

TEST_F(SurfaceTilesTest, ADamagedLeafCostsItselfAlone) {
  Densify();
  const Json tileset = Tileset();
  const auto whole = Content(tileset["root"]);
  ASSERT_OK(whole);
  EXPECT_TRUE(left_out_.empty());
  city_.Close();
  {
    StoredFamilies stored(city_.path());
    std::string key;
    for (const std::string& one : stored.Keys(Family::kSurface)) {
      if (one[0] == static_cast<char>(SurfacePart::kMesh)) key = one;
    }
    std::string value = *stored.Get(Family::kSurface, key);
    ASSERT_GT(value.size(), 100u);
    value[0] = static_cast<char>(value[0] ^ 0x40);
    stored.Put(Family::kSurface, key, value);
  }
  city_.Reopen();
  size_t damaged_leaves = 0, damaged_nodes = 0;
  Visit(tileset["root"], [&](const Json& node) {
    left_out_.clear();
    const auto content = Content(node);
    if (node.contains("children")) {
      ASSERT_OK(content);
      EXPECT_LE(left_out_.size(), 1u);
      damaged_nodes += left_out_.size();
    } else if (!content.ok()) {
      EXPECT_EQ(content.status().code(), StatusCode::kCorruption);
      ++damaged_leaves;
    }
  });
  EXPECT_EQ(damaged_leaves, 1u);
  EXPECT_GE(damaged_nodes, 1u);
  const auto root = Content(tileset["root"]);
  ASSERT_OK(root);
  ASSERT_EQ(left_out_.size(), 1u);
  EXPECT_NE(left_out_[0].find("reconstruction 1 at tile "), std::string::npos) << left_out_[0];
  const size_t triangles = TrianglesOf(GlbFile(*root));
  EXPECT_LT(triangles, TrianglesOf(GlbFile(*whole)));
  EXPECT_GT(triangles, 0u);
  const auto violations = city_.engine().Ask().Verify({});
  ASSERT_OK(violations);
  EXPECT_FALSE(violations->empty());
  for (const std::string& violation : *violations) std::printf("  %s\n", violation.c_str());
}

}  // namespace
}  // namespace veduta
