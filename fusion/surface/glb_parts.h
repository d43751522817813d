// SPDX-License-Identifier: Apache-2.0
#pragma once
// What files of binary glTF 2.0 are put together from (Khronos, "glTF 2.0 Specification", chapters
// 3 and 4): vertices, views and accessors of a buffer, chunks.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "fusion/surface/model_spool.h"

namespace veduta {

inline constexpr int kGlbPoints = 0, kGlbTriangles = 4;  // mode

struct GlbLayout {
  bool normals, colors;
  uint64_t stride() const { return 12u + (normals ? 12u : 0) + (colors ? 8u : 0); }
};

// Colours of vertices are light in glTF, in 16 bits: 8 would not do for dark ones.
AppendVertex GlbVertexBytes(const GlbLayout& layout);

// Views and accessors of a buffer, in the order of its bytes.
class GlbBuffer final {
 public:
  // Interleaved vertices; returns the primitive's attributes.
  nlohmann::json AddVertices(uint64_t count, const GlbLayout& layout,
                             const ModelSpool::Bounds& bounds);
  // Of 4 bytes each, or of 2. Returns the accessor.
  size_t AddIndices(uint64_t count, uint64_t index_bytes = 4);
  void MoveTo(nlohmann::json* document);

 private:
  size_t AddView(uint64_t size, int target);
  size_t AddAccessor(size_t view, uint64_t offset, uint64_t count, nlohmann::json accessor);

  nlohmann::json views_ = nlohmann::json::array(), accessors_ = nlohmann::json::array();
  uint64_t size_ = 0;
};

// A document with nothing in it, and the one material that surfaces and points have: their colours
// as they are, from both sides.
nlohmann::json GlbDocument();
void AddGlbMaterial(nlohmann::json* document);

// Everything before the bytes of the buffer, `binary_bytes` of them, a multiple of 4: header, the
// document as a chunk, the head of the other chunk. The size of the whole file is that of what is
// returned and `binary_bytes`; a glTF holds 4 GB at most, which the caller sees to.
std::string GlbHead(const nlohmann::json& document, uint64_t binary_bytes);

}  // namespace veduta
