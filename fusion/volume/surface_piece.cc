// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "fusion/volume/extraction.h"

namespace veduta {
namespace {

constexpr uint8_t kVersion = 1;
constexpr size_t kHeaderBytes = 1 + 4 + 4;
constexpr size_t kVertexBytes = 3 * 4 + 1 + 6 * 4 + 1;
constexpr size_t kTriangleBytes = 3 * 4;

void AppendWord(uint32_t value, std::vector<uint8_t>* bytes) {
  for (int shift = 0; shift < 32; shift += 8)
    bytes->push_back(static_cast<uint8_t>(value >> shift));
}
void AppendFloat(float value, std::vector<uint8_t>* bytes) {
  uint32_t word = 0;
  std::memcpy(&word, &value, sizeof(word));
  AppendWord(word, bytes);
}

// Reads on; the caller has compared the size.
class WordReader {
 public:
  explicit WordReader(std::span<const uint8_t> bytes) : bytes_(bytes) {}
  uint8_t Byte() { return bytes_[at_++]; }
  uint32_t Word() {
    uint32_t value = 0;
    for (int shift = 0; shift < 32; shift += 8) value |= static_cast<uint32_t>(Byte()) << shift;
    return value;
  }
  float Float() {
    const uint32_t word = Word();
    float value = 0;
    std::memcpy(&value, &word, sizeof(value));
    return value;
  }
  Eigen::Vector3f Vector() {
    const float x = Float(), y = Float(), z = Float();
    return {x, y, z};
  }

 private:
  std::span<const uint8_t> bytes_;
  size_t at_ = 0;
};

Status ReadVertex(WordReader* reader, SurfacePiece* piece) {
  VertexKey key;
  key.x = static_cast<int32_t>(reader->Word());
  key.y = static_cast<int32_t>(reader->Word());
  key.z = static_cast<int32_t>(reader->Word());
  key.axis = reader->Byte();
  if (key.axis > 2) return Status::Corruption("a surface piece has a vertex along no axis");
  if (!piece->keys.empty() && !(piece->keys.back() < key)) {
    return Status::Corruption("a surface piece's vertices are not in order");
  }
  piece->keys.push_back(key);
  piece->positions.push_back(reader->Vector());
  piece->normals.push_back(reader->Vector());
  piece->near_maps.push_back(reader->Byte());
  if (!piece->positions.back().allFinite() || !piece->normals.back().allFinite()) {
    return Status::Corruption("a surface piece has a vertex that is nowhere");
  }
  return Status::Ok();
}

}  // namespace

std::vector<uint8_t> Serialize(const SurfacePiece& piece) {
  std::vector<uint8_t> bytes;
  bytes.reserve(kHeaderBytes + kVertexBytes * piece.keys.size() +
                kTriangleBytes * piece.triangles.size());
  bytes.push_back(kVersion);
  AppendWord(static_cast<uint32_t>(piece.keys.size()), &bytes);
  AppendWord(static_cast<uint32_t>(piece.triangles.size()), &bytes);
  for (size_t i = 0; i < piece.keys.size(); ++i) {
    const VertexKey& key = piece.keys[i];
    for (const int32_t coordinate : {key.x, key.y, key.z})
      AppendWord(static_cast<uint32_t>(coordinate), &bytes);
    bytes.push_back(static_cast<uint8_t>(key.axis));
    for (int axis = 0; axis < 3; ++axis) AppendFloat(piece.positions[i][axis], &bytes);
    for (int axis = 0; axis < 3; ++axis) AppendFloat(piece.normals[i][axis], &bytes);
    bytes.push_back(piece.near_maps[i]);
  }
  for (const auto& triangle : piece.triangles) {
    for (const uint32_t vertex : triangle) AppendWord(vertex, &bytes);
  }
  return bytes;
}

Result<SurfacePiece> ParseSurfacePiece(std::span<const uint8_t> bytes) {
  if (bytes.size() < kHeaderBytes)
    return Status::Corruption("a surface piece ends within its header");
  WordReader reader(bytes);
  if (reader.Byte() != kVersion)
    return Status::Corruption("a surface piece of version " + std::to_string(bytes[0]));
  const uint64_t vertices = reader.Word(), triangles = reader.Word();
  if (bytes.size() != kHeaderBytes + kVertexBytes * vertices + kTriangleBytes * triangles) {
    return Status::Corruption("a surface piece of " + std::to_string(bytes.size()) +
                              " bytes says it has " + std::to_string(vertices) + " vertices and " +
                              std::to_string(triangles) + " triangles");
  }
  SurfacePiece piece;
  for (uint64_t i = 0; i < vertices; ++i) VEDUTA_RETURN_IF_ERROR(ReadVertex(&reader, &piece));
  for (uint64_t i = 0; i < triangles; ++i) {
    const uint32_t a = reader.Word(), b = reader.Word(), c = reader.Word();
    if (a >= vertices || b >= vertices || c >= vertices || a == b || b == c || c == a) {
      return Status::Corruption("a surface piece has a triangle that is none");
    }
    piece.triangles.push_back({a, b, c});
  }
  return piece;
}

SurfacePiece WeldPieces(std::span<const SurfacePiece* const> pieces) {
  struct Source {
    VertexKey key;
    uint32_t piece, vertex;
    auto operator<=>(const Source&) const = default;
  };
  std::vector<Source> sources;
  std::vector<std::vector<uint32_t>> number(pieces.size());
  for (uint32_t p = 0; p < pieces.size(); ++p) {
    number[p].resize(pieces[p]->keys.size());
    for (uint32_t v = 0; v < pieces[p]->keys.size(); ++v)
      sources.push_back({pieces[p]->keys[v], p, v});
  }
  std::sort(sources.begin(), sources.end());
  SurfacePiece whole;
  for (const Source& source : sources) {
    if (whole.keys.empty() || whole.keys.back() != source.key) {
      const SurfacePiece& piece = *pieces[source.piece];
      whole.keys.push_back(source.key);
      whole.positions.push_back(piece.positions[source.vertex]);
      whole.normals.push_back(piece.normals[source.vertex]);
      whole.near_maps.push_back(piece.near_maps[source.vertex]);
    }
    number[source.piece][source.vertex] = static_cast<uint32_t>(whole.keys.size() - 1);
  }
  for (size_t p = 0; p < pieces.size(); ++p) {
    for (const auto& t : pieces[p]->triangles) {
      whole.triangles.push_back({number[p][t[0]], number[p][t[1]], number[p][t[2]]});
    }
  }
  return whole;
}

}  // namespace veduta
