// SPDX-License-Identifier: Apache-2.0
// What tiles of the dense pass are stored as. The first byte chooses: a block of histograms, a
// solved block or a mesh.
#include "fusion/volume/extraction.h"
#include "fusion/volume/histogram.h"
#include "fusion/volume/solution.h"
#include "tools/fuzz/fuzz_target.h"

namespace veduta::fuzz {
namespace {

SurfacePiece Triangle() {
  SurfacePiece piece;
  piece.keys = {{0, 0, 0, 0}, {0, 0, 0, 1}, {0, 0, 0, 2}};
  piece.positions = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  piece.normals.assign(3, Eigen::Vector3f(0, 0, 1));
  piece.near_maps.assign(3, 4);
  piece.triangles = {{0, 1, 2}};
  return piece;
}

}  // namespace

std::vector<std::string> Seeds() {
  const std::string histograms = '\0' + Text(Serialize(HistogramBlock()));
  // Bin 0 and the free space of the first voxel, with their counters.
  std::string counted = histograms;
  counted[2] = '\x81';
  counted += "\x02\x05\x03\x01";
  SolutionBlock solution;
  solution.value[7] = -kSolutionOne;
  solution.support[7] = 3;
  return {histograms, counted, '\1' + Text(Serialize(solution)), '\2' + Text(Serialize(Triangle())),
          '\2' + Text(Serialize(SurfacePiece()))};
}

}  // namespace veduta::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using veduta::fuzz::Expect;
  if (size == 0) return 0;
  const std::span<const uint8_t> bytes(data + 1, size - 1);
  const auto same = [&](const std::vector<uint8_t>& again) {
    return std::equal(again.begin(), again.end(), bytes.begin(), bytes.end());
  };
  if (data[0] % 3 == 0) {
    const auto block = veduta::ParseHistogramBlock(bytes);
    if (block.ok()) Expect(same(Serialize(**block)), "histograms are written as they were");
  } else if (data[0] % 3 == 1) {
    const auto block = veduta::ParseSolutionBlock(bytes);
    if (block.ok()) Expect(same(Serialize(**block)), "a solution is written as it was");
  } else {
    const auto piece = veduta::ParseSurfacePiece(bytes);
    if (piece.ok()) Expect(same(Serialize(*piece)), "a mesh is written as it was");
  }
  return 0;
}
