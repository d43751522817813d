// SPDX-License-Identifier: Apache-2.0
// Goal: a tile's content is a right binary glTF, and shows the mesh where it is.
// Method: a reader of its own (glb_reader.h) on small surfaces far from the origin; positions as a
//   viewer of 3D Tiles computes them; what is no mesh is refused.
#include "fusion/surface/glb_tile.h"

#include <limits>

#include "fusion/surface/color_view.h"
#include "tests/fusion/surface/glb_reader.h"
#include "tests/fusion/surface/sample_surfaces.h"

namespace veduta {
namespace {

// z up, from glTF's y up: x, -z, y.
Eigen::Vector3d PlaceOf(const GlbFile& file, const std::vector<double>& position) {
  const auto& translation = file.json["nodes"][0]["translation"];
  const auto at = [&](size_t k) { return position[k] + translation[k].get<double>(); };
  return {at(0), -at(2), at(1)};
}

TEST(GlbTile, ShowsTheMeshWhereItIs) {
  TriangleMesh mesh = Sphere(Eigen::Vector3d(5000, -300, 20), 2, 12);
  mesh.normals.clear();
  for (size_t i = 0; i < mesh.positions.size(); ++i)
    mesh.colors.push_back({static_cast<uint8_t>(i), 200, 3});
  const Eigen::Vector3d center(5000.25, -300, 20);
  const auto bytes = MakeGlbTile(mesh, center);
  ASSERT_TRUE(bytes.ok()) << bytes.status().message();
  const GlbFile file(*bytes);
  const auto& primitive = file.json["meshes"][0]["primitives"][0];
  EXPECT_FALSE(primitive.contains("mode"));  // triangles
  EXPECT_FALSE(primitive["attributes"].contains("NORMAL"));
  const auto positions = file.Read(primitive["attributes"]["POSITION"]);
  const auto colors = file.Read(primitive["attributes"]["COLOR_0"]);
  ASSERT_EQ(positions.size(), mesh.positions.size());
  for (size_t i = 0; i < positions.size(); ++i) {
    EXPECT_LT((PlaceOf(file, positions[i]) - mesh.positions[i].cast<double>()).norm(), 1e-6);
    EXPECT_EQ(SrgbFromLight(static_cast<float>(colors[i][0])), mesh.colors[i][0]);
    EXPECT_EQ(SrgbFromLight(static_cast<float>(colors[i][1])), 200);
    EXPECT_EQ(colors[i][3], 1);
  }
  const auto indices = file.Read(primitive["indices"]);
  ASSERT_EQ(indices.size(), mesh.triangles.size() * 3);
  for (size_t i = 0; i < indices.size(); ++i)
    EXPECT_EQ(indices[i][0], mesh.triangles[i / 3][i % 3]);
  EXPECT_EQ(file.json["accessors"][primitive["indices"].get<size_t>()]["componentType"], 5123);
  EXPECT_EQ(*MakeGlbTile(mesh, center), *bytes);
}

TEST(GlbTile, TakesWideIndicesWhereNarrowOnesDoNotReach) {
  const TriangleMesh mesh = FlatSheet(300, 300, 0.1);
  const auto bytes = MakeGlbTile(mesh, Eigen::Vector3d::Zero());
  ASSERT_TRUE(bytes.ok());
  const GlbFile file(*bytes);
  const auto& primitive = file.json["meshes"][0]["primitives"][0];
  const auto indices = file.Read(primitive["indices"]);
  EXPECT_EQ(indices.back()[0], mesh.triangles.back()[2]);
  EXPECT_GT(mesh.positions.size(), 65535u);
  EXPECT_NEAR(file.Read(primitive["attributes"]["COLOR_0"])[0][0], double{LightFromSrgb(128)},
              1e-4);
}

TEST(GlbTile, OfNothingIsAnEmptyScene) {
  const auto bytes = MakeGlbTile({}, Eigen::Vector3d::Zero());
  ASSERT_TRUE(bytes.ok());
  const GlbFile file(*bytes);
  EXPECT_FALSE(file.json["scenes"][0].contains("nodes"));
  EXPECT_FALSE(file.json.contains("meshes"));
}

TEST(GlbTile, RefusesWhatIsNoMesh) {
  TriangleMesh mesh = FlatSheet(2, 2, 1);
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_EQ(MakeGlbTile(mesh, {infinite, 0, 0}).status().code(), StatusCode::kInvalidArgument);
  mesh.triangles[1][2] = 99;
  EXPECT_EQ(MakeGlbTile(mesh, Eigen::Vector3d::Zero()).status().code(),
            StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace veduta
