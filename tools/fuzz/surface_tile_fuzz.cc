// SPDX-License-Identifier: Apache-2.0
// What viewers ask for and what they get. The first byte chooses: the name of a content, or a
// stored mesh, which becomes a coarser one and a file of glTF.
#include "fusion/surface/glb_tile.h"
#include "fusion/tileset/coarser_mesh.h"
#include "fusion/tileset/tile_tree.h"
#include "fusion/volume/extraction.h"
#include "tools/fuzz/fuzz_target.h"

namespace veduta::fuzz {
namespace {

SurfacePiece Triangle() {
  SurfacePiece piece;
  piece.keys = {{0, 0, 0, 0}, {0, 0, 0, 1}, {0, 0, 0, 2}};
  piece.positions = {{9, 0, 0}, {0, 9, 0}, {0, 0, 9}};
  piece.normals.assign(3, Eigen::Vector3f(0, 0, 1));
  piece.near_maps.assign(3, 4);
  piece.triangles = {{0, 1, 2}};
  return piece;
}

void Show(const SurfacePiece& piece) {
  const TriangleMesh mesh = {
      piece.positions, {}, {piece.positions.size(), {10, 20, 30}}, piece.triangles};
  Expect(MakeGlbTile(mesh, Eigen::Vector3d(1, 2, 3)).status(), "what is read can be shown");
  TileNode node;
  node.level = 1;
  const TriangleMesh* const children[] = {&mesh};
  const auto coarse = JoinCells(node, 1, children);
  if (!coarse.ok()) return;  // vertices outside of the node
  Expect(coarse->triangles.size() <= mesh.triangles.size(), "a coarser mesh has no more triangles");
  Expect(MakeGlbTile(*coarse, Eigen::Vector3d::Zero()).status(), "a coarser mesh can be shown");
}

}  // namespace

std::vector<std::string> Seeds() {
  return {'\0' + std::string("0_1_-2_3_0123456789abcdef"),
          '\0' + std::string("12_-1_0_2097151_ffffffffffffffff"),
          '\1' + Text(Serialize(Triangle()))};
}

}  // namespace veduta::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  if (data[0] % 2 == 0) {
    const std::string name(veduta::fuzz::Text(data + 1, size - 1));
    const auto parsed = veduta::ParseTileName(name);
    if (parsed) {
      veduta::fuzz::Expect(
          veduta::TileName({parsed->level, parsed->place, parsed->version, {}, 0, {}}) == name,
          "a name is written as it was");
    }
  } else {
    const auto piece = veduta::ParseSurfacePiece({data + 1, size - 1});
    if (piece.ok()) veduta::fuzz::Show(*piece);
  }
  return 0;
}
