// SPDX-License-Identifier: Apache-2.0
#pragma once
// What PLY and glTF writing have in common: pieces welded, checked and spooled. Bytes of a vertex
// are the format's.

#include <functional>
#include <optional>
#include <string>

#include "fusion/surface/model_writer.h"
#include "fusion/surface/spool_file.h"
#include "fusion/surface/vertex_weld.h"

namespace veduta {

// One vertex or point, complete: normal unit (0, 0, 1 where unknown), colour grey 128 where
// unknown.
struct SpooledVertex {
  Eigen::Vector3f position, normal;
  std::array<uint8_t, 3> rgb;
};

using AppendVertex = std::function<void(const SpooledVertex&, std::vector<uint8_t>*)>;
using AppendTriangle = std::function<void(const std::array<uint32_t, 3>&, std::vector<uint8_t>*)>;

class ModelSpool final {
 public:
  // The files PATH.vertices, PATH.triangles and PATH.points, each made when first needed.
  ModelSpool(std::string path, AppendVertex append_vertex, AppendTriangle append_triangle,
             AppendVertex append_point);

  // Errors: as ModelWriter::AddMesh and AddPoints; also kInvalidArgument above 2^31 vertices or
  // points.
  Status AddMesh(const TriangleMesh& mesh, std::span<const uint64_t> keys);
  Status AddPoints(std::span<const CloudPoint> points);

  const std::string& path() const { return path_; }
  const ModelCounts& counts() const { return counts_; }
  uint64_t size_bytes() const;  // of all three
  // Vertices, then triangles, then points.
  Status CopyTo(std::ofstream& out);
  // What is spooled is no longer needed.
  void RemoveFiles();

  struct Bounds {
    Eigen::Vector3f low, high;
  };
  const Bounds& mesh_bounds() const {
    return mesh_bounds_;
  }  // of what was written; for empty ones: not to be read
  const Bounds& point_bounds() const { return point_bounds_; }

 private:
  Status Flush(std::optional<SpoolFile>* file, const char* suffix,
               const std::vector<uint8_t>& bytes);

  const std::string path_;
  const AppendVertex append_vertex_;
  const AppendTriangle append_triangle_;
  const AppendVertex append_point_;
  VertexWeld weld_;
  std::optional<SpoolFile> vertices_, triangles_, points_;
  ModelCounts counts_;
  Bounds mesh_bounds_, point_bounds_;
};

// The bytes of a value, little-endian.
template <typename T>
void AppendBytes(const T& value, std::vector<uint8_t>* bytes) {
  const auto* const begin = reinterpret_cast<const uint8_t*>(&value);
  bytes->insert(bytes->end(), begin, begin + sizeof value);
}

}  // namespace veduta
