// SPDX-License-Identifier: Apache-2.0
// Goal: other programs read what we write: every vertex, triangle, normal, colour and camera,
//   once, tiles welded; and nothing half-written is left behind.
// Method: PLY read back by OpenMesh; glTF by a reader that checks what the specification asks;
//   cameras carried through glTF's own projection.
#include "fusion/surface/model_writer.h"

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <limits>

#include "fusion/surface/color_view.h"
#include "fusion/surface/vertex_weld.h"
#include "tests/fusion/surface/glb_reader.h"
#include "tests/fusion/surface/sample_surfaces.h"

namespace veduta {
namespace {

TriangleMesh ColoredSheet() {
  TriangleMesh mesh =
      Sheet(30, 20, 0.1, [](double x, double y) { return 0.3 * std::sin(3 * x + y); });
  SeededRandom random(4);
  for (size_t v = 0; v < mesh.positions.size(); ++v) {
    std::array<uint8_t, 3> color;
    for (uint8_t& value : color) value = static_cast<uint8_t>(random.Below(256));
    mesh.colors.push_back(color);
  }
  return mesh;
}

// Vertices are told by their places: order is the writer's business, and places here are unique.
using Place = std::array<float, 3>;
Place PlaceOf(const Eigen::Vector3f& x) {
  return {x.x(), x.y(), x.z()};
}
using TrianglePlaces = std::array<Place, 3>;
// The corner that comes first in space leads; the sense of rotation stays.
TrianglePlaces Turned(TrianglePlaces t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}
std::vector<TrianglePlaces> TrianglesOf(const TriangleMesh& mesh) {
  std::vector<TrianglePlaces> list;
  for (const auto& [a, b, c] : mesh.triangles) {
    list.push_back(Turned(
        {PlaceOf(mesh.positions[a]), PlaceOf(mesh.positions[b]), PlaceOf(mesh.positions[c])}));
  }
  std::sort(list.begin(), list.end());
  return list;
}

TriangleMesh ReadPly(const std::string& path) {
  using Mesh = OpenMesh::TriMesh_ArrayKernelT<>;
  Mesh read;
  read.request_vertex_normals();
  read.request_vertex_colors();
  OpenMesh::IO::Options options(OpenMesh::IO::Options::VertexNormal |
                                OpenMesh::IO::Options::VertexColor);
  EXPECT_TRUE(OpenMesh::IO::read_mesh(read, path, options)) << path;
  EXPECT_TRUE(options.check(OpenMesh::IO::Options::VertexNormal));
  EXPECT_TRUE(options.check(OpenMesh::IO::Options::VertexColor));
  TriangleMesh mesh;
  for (const auto v : read.vertices()) {
    const auto& p = read.point(v);
    const auto& n = read.normal(v);
    const auto& c = read.color(v);
    mesh.positions.emplace_back(p[0], p[1], p[2]);
    mesh.normals.emplace_back(n[0], n[1], n[2]);
    mesh.colors.push_back({c[0], c[1], c[2]});
  }
  for (const auto f : read.faces()) {
    std::array<uint32_t, 3> triangle;
    int k = 0;
    for (const auto v : f.vertices()) triangle[k++] = static_cast<uint32_t>(v.idx());
    mesh.triangles.push_back(triangle);
  }
  return mesh;
}

ModelCounts WriteTiles(ModelWriter& writer, const TriangleMesh& whole) {
  for (const Tile& tile : CutIntoTiles(whole, 0.7)) {
    const Status added = writer.AddMesh(tile.mesh, tile.keys);
    EXPECT_TRUE(added.ok()) << added.message();
  }
  const auto counts = writer.Finish();
  EXPECT_TRUE(counts.ok()) << counts.status().message();
  return counts.value();
}

std::vector<ExportedCamera> Cameras() {
  std::vector<ExportedCamera> cameras;
  for (int i = 0; i < 3; ++i) {
    ExportedCamera camera = {
        "walk/photo " + std::to_string(i) + " \"a\" \xc3\xa9.jpg",
        LookAt({1.0 + i, -2, 1.5}, {1.5, 1, 0.2 * i}, {0.1, 0, 1}, 640, 480, 60).value()};
    camera.geometry.camera.fy *= 1.02;
    cameras.push_back(camera);
  }
  return cameras;
}

TEST(ModelWriter, OpenMeshReadsTheWholeSurfaceFromTiles) {
  const SampleFolder folder("ply");
  const TriangleMesh whole = ColoredSheet();
  const auto writer = OpenPly(folder / "a.ply", {}).value();
  const ModelCounts counts = WriteTiles(*writer, whole);
  EXPECT_EQ(counts.vertices, whole.positions.size());
  EXPECT_EQ(counts.triangles, whole.triangles.size());
  const TriangleMesh read = ReadPly(folder / "a.ply");
  ASSERT_EQ(read.positions.size(), whole.positions.size());
  EXPECT_EQ(TrianglesOf(read), TrianglesOf(whole));
  std::map<Place, size_t> at;
  for (size_t v = 0; v < whole.positions.size(); ++v) at[PlaceOf(whole.positions[v])] = v;
  for (size_t v = 0; v < read.positions.size(); ++v) {
    const size_t w = at.at(PlaceOf(read.positions[v]));
    EXPECT_LT((read.normals[v] - whole.normals[w]).norm(), 1e-6);
    EXPECT_EQ(read.colors[v], whole.colors[w]);
  }
  EXPECT_EQ(folder.file_count(), 1u);
  // Without keys nothing is welded.
  const auto loose = OpenPly(folder / "b.ply", {}).value();
  uint64_t vertices = 0;
  for (const Tile& tile : CutIntoTiles(whole, 0.7)) {
    ASSERT_TRUE(loose->AddMesh(tile.mesh, {}).ok());
    vertices += tile.mesh.positions.size();
  }
  EXPECT_EQ(loose->Finish().value().vertices, vertices);
  EXPECT_GT(vertices, whole.positions.size() + 50);
}

TEST(ModelWriter, PointsAsPly) {
  const SampleFolder folder("points");
  std::vector<CloudPoint> points;
  for (int i = 0; i < 100; ++i) {
    points.push_back({Eigen::Vector3f(static_cast<float>(i), 2, 3),
                      Eigen::Vector3f::UnitX(),
                      {static_cast<uint8_t>(i), 5, 250}});
  }
  const auto writer = OpenPly(folder / "p.ply", {}).value();
  ASSERT_TRUE(writer->AddPoints(std::span(points).first(40)).ok());
  ASSERT_TRUE(writer->AddPoints(std::span(points).subspan(40)).ok());
  EXPECT_EQ(writer->Finish().value().points, 100u);
  const TriangleMesh read = ReadPly(folder / "p.ply");
  ASSERT_EQ(read.positions.size(), 100u);
  EXPECT_EQ(read.positions[99], points[99].position);
  EXPECT_EQ(read.normals[99], points[99].normal);
  EXPECT_EQ(read.colors[99], points[99].rgb);
}

TEST(ModelWriter, GltfHoldsSurfacePointsAndCameras) {
  const SampleFolder folder("glb");
  const TriangleMesh whole = ColoredSheet();
  const std::vector<ExportedCamera> cameras = Cameras();
  const Eigen::Vector3d up(0.1, -0.2, 1);
  const auto writer = OpenGlb(folder / "a.glb", {}, up).value();
  ASSERT_TRUE(writer->AddCameras(cameras).ok());
  const std::vector<CloudPoint> points = {{{1, 2, 3}, {0, 0, 0}, {10, 20, 30}},
                                          {{-1, 0, 9}, {0, 0, 0}, {40, 50, 60}}};
  ASSERT_TRUE(writer->AddPoints(points).ok());
  const ModelCounts counts = WriteTiles(*writer, whole);
  EXPECT_EQ(counts.cameras, 3u);
  const GlbFile file(folder / "a.glb");
  ASSERT_EQ(file.json["meshes"].size(), 2u);
  const auto& surface = file.json["meshes"][0]["primitives"][0];
  EXPECT_EQ(surface["mode"], 4);
  const auto positions = file.Read(surface["attributes"]["POSITION"]);
  const auto normals = file.Read(surface["attributes"]["NORMAL"]);
  const auto colors = file.Read(surface["attributes"]["COLOR_0"]);
  const auto indices = file.Read(surface["indices"]);
  ASSERT_EQ(positions.size(), whole.positions.size());
  TriangleMesh read;
  std::map<Place, size_t> at;
  for (size_t v = 0; v < whole.positions.size(); ++v) at[PlaceOf(whole.positions[v])] = v;
  for (size_t v = 0; v < positions.size(); ++v) {
    read.positions.push_back(Eigen::Vector3d(positions[v].data()).cast<float>());
    const size_t w = at.at(PlaceOf(read.positions.back()));
    EXPECT_LT((Eigen::Vector3d(normals[v].data()) - whole.normals[w].cast<double>()).norm(), 1e-6);
    EXPECT_NEAR(Eigen::Vector3d(normals[v].data()).norm(), 1, 1e-6);
    for (int c = 0; c < 3; ++c)
      EXPECT_EQ(SrgbFromLight(static_cast<float>(colors[v][c])), whole.colors[w][c]);
    EXPECT_EQ(colors[v][3], 1);
  }
  ASSERT_EQ(indices.size(), 3 * whole.triangles.size());
  for (size_t i = 0; i < indices.size(); i += 3) {
    std::array<uint32_t, 3> triangle;
    for (size_t k = 0; k < 3; ++k) {
      ASSERT_LT(indices[i + k][0], positions.size());
      triangle[k] = static_cast<uint32_t>(indices[i + k][0]);
    }
    read.triangles.push_back(triangle);
  }
  EXPECT_EQ(TrianglesOf(read), TrianglesOf(whole));
  const auto& cloud = file.json["meshes"][1]["primitives"][0];
  EXPECT_EQ(cloud["mode"], 0);
  EXPECT_EQ(file.Read(cloud["attributes"]["POSITION"])[1], (std::vector<double>{-1, 0, 9}));
  EXPECT_EQ(SrgbFromLight(static_cast<float>(file.Read(cloud["attributes"]["COLOR_0"])[1][1])), 50);
  // The root turns up to +y.
  const auto& turn = file.json["nodes"][0]["rotation"];
  const Eigen::Quaterniond root(turn[3], turn[0], turn[1], turn[2]);
  EXPECT_LT((root * up.normalized() - Eigen::Vector3d::UnitY()).norm(), 1e-12);
  EXPECT_EQ(file.json["nodes"][0]["children"].size(), 5u);
}

TEST(ModelWriter, GltfCamerasSeeWhatOursSee) {
  const SampleFolder folder("cameras");
  const std::vector<ExportedCamera> cameras = Cameras();
  const auto writer = OpenGlb(folder / "a.glb", {}, Eigen::Vector3d::UnitZ()).value();
  ASSERT_TRUE(writer->AddCameras(cameras).ok());
  ASSERT_TRUE(writer->Finish().ok());
  const GlbFile file(folder / "a.glb");
  const Eigen::Vector3d point(1.7, 0.9, 0.3);
  for (size_t i = 0; i < cameras.size(); ++i) {
    const auto& node = file.json["nodes"][i + 1];
    EXPECT_EQ(node["name"], cameras[i].name);
    const auto& r = node["rotation"];
    const auto& t = node["translation"];
    const Eigen::Quaterniond rotation(r[3], r[0], r[1], r[2]);
    const Eigen::Vector3d in_cam =
        rotation.conjugate() * (point - Eigen::Vector3d(t[0], t[1], t[2]));
    ASSERT_LT(in_cam.z(), 0);  // looks along -z
    const auto& lens = file.json["cameras"][node["camera"].get<size_t>()]["perspective"];
    const double half = std::tan(lens["yfov"].get<double>() / 2);
    const double x = in_cam.x() / -in_cam.z() / half / lens["aspectRatio"].get<double>(),
                 y = in_cam.y() / -in_cam.z() / half;
    // From the middle of the picture, in halves of it, y up; the principal point is in the middle
    // here.
    const Eigen::Vector2d px =
        cameras[i].geometry.camera.Project(cameras[i].geometry.cam_from_world * point);
    EXPECT_NEAR((x + 1) / 2 * 640 - 0.5, px.x(), 1e-6);
    EXPECT_NEAR((1 - y) / 2 * 480 - 0.5, px.y(), 1e-6);
    const auto& extras = file.json["cameras"][i]["extras"];
    EXPECT_EQ(extras["fy"].get<double>(), cameras[i].geometry.camera.fy);
    EXPECT_EQ(extras["width"], 640);
  }
}

TEST(ModelWriter, CamerasBesideAPly) {
  const SampleFolder folder("beside");
  const std::vector<ExportedCamera> cameras = Cameras();
  ASSERT_TRUE(WriteCameras(folder / "cameras", cameras, 0.5).ok());
  const std::vector<uint8_t> text = ReadBytes(folder / "cameras.json");
  const auto json = nlohmann::json::parse(text.begin(), text.end());
  ASSERT_EQ(json.size(), 3u);
  EXPECT_EQ(json[1]["name"], cameras[1].name);
  const Rigid3& pose = cameras[1].geometry.cam_from_world;
  const Eigen::Matrix3d world_from_cam = pose.rotation.toRotationMatrix().transpose();
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(json[1]["center"][i].get<double>(), pose.Center()[i], 1e-12);
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(json[1]["world_from_cam"][i][k].get<double>(), world_from_cam(i, k), 1e-12);
  }
  const auto read = ReadBytes(folder / "cameras.ply");
  const std::string header(read.begin(), read.begin() + 300);
  EXPECT_NE(header.find("element vertex 15\n"), std::string::npos);
  EXPECT_NE(header.find("element face 18\n"), std::string::npos);
  EXPECT_EQ(folder.file_count(), 2u);
  EXPECT_EQ(WriteCameras(folder / "c", cameras, 0).code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(WriteCameras(folder / "none/c", cameras, 1).code(), StatusCode::kIoError);
}

TEST(ModelWriter, EmptyAndHostileInput) {
  const SampleFolder folder("hostile");
  const auto empty_ply = OpenPly(folder / "empty.ply", {}).value();
  ASSERT_TRUE(empty_ply->AddMesh({}, {}).ok());
  EXPECT_EQ(empty_ply->Finish().value().vertices, 0u);
  const auto empty_glb = OpenGlb(folder / "empty.glb", {}, Eigen::Vector3d::UnitZ()).value();
  ASSERT_TRUE(empty_glb->Finish().ok());
  EXPECT_FALSE(GlbFile(folder / "empty.glb").json.contains("meshes"));
  EXPECT_FALSE(OpenGlb(folder / "x.glb", {}, Eigen::Vector3d::Zero()).ok());
  {
    const auto writer = OpenGlb(folder / "bad.glb", {}, Eigen::Vector3d::UnitZ()).value();
    ASSERT_TRUE(writer->AddMesh(FlatSheet(2, 2, 1), {}).ok());
    TriangleMesh mesh = FlatSheet(2, 2, 1);
    mesh.triangles[0][2] = 9;
    EXPECT_EQ(writer->AddMesh(mesh, {}).code(), StatusCode::kInvalidArgument);
    mesh = FlatSheet(2, 2, 1);
    mesh.positions[4].x() = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(writer->AddMesh(mesh, {}).code(), StatusCode::kInvalidArgument);
    EXPECT_EQ(writer->AddMesh(FlatSheet(2, 2, 1), std::vector<uint64_t>(8)).code(),
              StatusCode::kInvalidArgument);
    CloudPoint point;
    point.position = {0, std::numeric_limits<float>::infinity(), 0};
    EXPECT_EQ(writer->AddPoints(std::span(&point, 1)).code(), StatusCode::kInvalidArgument);
    ExportedCamera camera = Cameras()[0];
    camera.geometry.camera.fx = 0;
    EXPECT_NE(writer->AddCameras(std::span(&camera, 1)).message().find("photo 0"),
              std::string::npos);
  }
  EXPECT_EQ(folder.file_count(), 2u);  // the writer that did not finish left nothing
  const auto mixed = OpenPly(folder / "mixed.ply", {}).value();
  ASSERT_TRUE(mixed->AddMesh(FlatSheet(2, 2, 1), {}).ok());
  const CloudPoint point = {{1, 2, 3}};
  EXPECT_EQ(mixed->AddPoints(std::span(&point, 1)).code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(mixed->AddCameras(Cameras()).code(), StatusCode::kInvalidArgument);
  const auto nowhere = OpenPly(folder / "none/a.ply", {}).value();
  EXPECT_EQ(nowhere->AddMesh(FlatSheet(2, 2, 1), {}).code(), StatusCode::kIoError);
  EXPECT_EQ(nowhere->Finish().status().code(), StatusCode::kIoError);
}

TEST(VertexWeld, NormalsAndColoursMayBeMissingAndTrianglesDegenerate) {
  const SampleFolder folder("missing");
  TriangleMesh mesh = FlatSheet(2, 1, 1);
  mesh.normals.clear();
  mesh.positions.push_back({9, 9, 9});  // of no triangle
  mesh.triangles.push_back({1, 1, 2});  // no triangle
  const auto writer = OpenGlb(folder / "a.glb", {}, Eigen::Vector3d::UnitZ()).value();
  ASSERT_TRUE(writer->AddMesh(mesh, {}).ok());
  const ModelCounts counts = writer->Finish().value();
  EXPECT_EQ(counts.vertices, 6u);
  EXPECT_EQ(counts.triangles, 4u);
  const GlbFile file(folder / "a.glb");
  const auto& attributes = file.json["meshes"][0]["primitives"][0]["attributes"];
  EXPECT_EQ(file.Read(attributes["NORMAL"])[5], (std::vector<double>{0, 0, 1}));
  EXPECT_EQ(SrgbFromLight(static_cast<float>(file.Read(attributes["COLOR_0"])[5][2])), 128);
  EXPECT_EQ(file.Read(attributes["POSITION"]).size(), 6u);

  EXPECT_EQ(WeldKey(1, 2, 3, 4).status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(WeldKey(1, 1 << 19, 3, 1).status().code(), StatusCode::kInvalidArgument);
  std::vector<uint64_t> keys;
  for (const int32_t x : {-(1 << 19), -1, 0, (1 << 19) - 1}) {
    for (const int32_t y : {-7, 0, 5}) {
      for (int32_t axis = 0; axis < 3; ++axis) keys.push_back(WeldKey(x, y, x, axis).value());
    }
  }
  EXPECT_TRUE(std::is_sorted(keys.begin(), keys.end()));
  EXPECT_EQ(std::adjacent_find(keys.begin(), keys.end()), keys.end());
}

}  // namespace
}  // namespace veduta
