// SPDX-License-Identifier: Apache-2.0
#pragma once
// Models for other programs: binary PLY and glTF 2.0, written piece by piece.
//
// A surface of many tiles is written without holding more than one of them, and the keys of
// vertices on borders. While it is written, PATH.vertices and PATH.triangles stand beside PATH;
// PATH itself appears by a rename at the end.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "storage/base/status.h"
#include "storage/model/triangle_mesh.h"
#include "storage/model/view.h"

namespace veduta {

struct CloudPoint {
  Eigen::Vector3f position;                          // world
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  // unit, or zero: not known
  std::array<uint8_t, 3> rgb = {128, 128, 128};      // sRGB
};

struct ExportedCamera {
  std::string name;  // the photo's, as in the database; UTF-8
  ViewGeometry geometry;
};

struct ModelContents {
  bool normals = true,
       colors = true;  // of the surface's vertices; what a tile lacks is (0, 0, 1) or grey 128
};

struct ModelCounts {
  uint64_t vertices = 0, triangles = 0, points = 0, cameras = 0;
};

// A key for a vertex on the edge that goes from voxel (x, y, z) along `axis` (0, 1, 2).
// kInvalidArgument where a coordinate is outside [-2^19, 2^19) (26 km of voxels of 5 cm each way),
// or the axis is none.
Result<uint64_t> WeldKey(int32_t x, int32_t y, int32_t z, int32_t axis);

// One model in the making. Not thread-safe. Without Finish nothing is left behind.
class ModelWriter {
 public:
  virtual ~ModelWriter() = default;

  // A piece of the surface. Vertices with equal keys on the borders of pieces are written once (the
  // first one's normal and colour stand); keys are unique within a piece; no keys: nothing is
  // welded. Vertices of no triangle, and triangles that name a vertex twice, are left out.
  // kInvalidArgument as CheckMesh, or keys that are not as many as vertices; kIoError with the
  // path.
  virtual Status AddMesh(const TriangleMesh& mesh, std::span<const uint64_t> keys) = 0;
  // Points that belong to no surface. A PLY holds either a surface or points: kInvalidArgument.
  virtual Status AddPoints(std::span<const CloudPoint> points) = 0;
  // glTF: a node with a perspective camera. PLY: kInvalidArgument, see WriteCameras.
  virtual Status AddCameras(std::span<const ExportedCamera> cameras) = 0;
  // Puts the file together. kIoError with the path; kInvalidArgument for a glTF above 4 GB (write a
  // PLY).
  virtual Result<ModelCounts> Finish() = 0;
};

// Binary little-endian PLY: x y z [nx ny nz] [red green blue], faces as lists of vertex_indices.
Result<std::unique_ptr<ModelWriter>> OpenPly(const std::string& path,
                                             const ModelContents& contents);

// Binary glTF 2.0 (.glb): one mesh of triangles, one of points (without normals), a node for each
// camera, all below a root node that turns the world so that `up_in_world` becomes glTF's +y.
// Colours are light, as glTF wants them (16 bits a channel), on an unlit material
// (KHR_materials_unlit). A camera's node and camera bear the photo's name; the camera's extras hold
// width, height, fx, fy, cx, cy in px, (0, 0) the centre of the top-left pixel: glTF's own cameras
// look along -z with y up and have their principal point in the middle. kInvalidArgument if
// `up_in_world` has no direction.
Result<std::unique_ptr<ModelWriter>> OpenGlb(const std::string& path, const ModelContents& contents,
                                             const Eigen::Vector3d& up_in_world);

// Cameras for a PLY: `PREFIX.json` (an array of objects: name, width, height, fx, fy, cx, cy,
// center [3], world_from_cam [3][3], x right, y down, z forward) and `PREFIX.ply`, a pyramid for
// each camera, `depth` world units long, which every viewer of meshes shows. kIoError with the
// path.
Status WriteCameras(const std::string& prefix, std::span<const ExportedCamera> cameras,
                    double depth);

// The mean of the cameras' up directions, unit; +z without cameras or where they cancel out. The
// cameras are those of upright photos, cam_from_world: -y of such a one is up in it.
Eigen::Vector3d MeanUp(std::span<const Rigid3> upright_cams);

}  // namespace veduta
