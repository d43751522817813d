// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/glb_parts.h"

#include <cmath>
#include <initializer_list>
#include <utility>

#include "fusion/surface/color_view.h"

namespace veduta {
namespace {

using nlohmann::json;

constexpr uint32_t kMagic = 0x46546C67, kVersion = 2, kJsonChunk = 0x4E4F534A,
                   kBinaryChunk = 0x004E4942;
constexpr int kFloat = 5126, kUnsignedInt = 5125, kUnsignedShort = 5123;  // componentType
constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963;          // target

void AppendColor(const std::array<uint8_t, 3>& rgb, std::vector<uint8_t>* bytes) {
  for (const uint8_t value : rgb) {
    AppendBytes(static_cast<uint16_t>(std::lround(LightFromSrgb(value) * 65535)), bytes);
  }
  AppendBytes(uint16_t{65535}, bytes);
}

json Triple(const Eigen::Vector3f& v) {
  return {double{v.x()}, double{v.y()}, double{v.z()}};
}

}  // namespace

AppendVertex GlbVertexBytes(const GlbLayout& layout) {
  return [layout](const SpooledVertex& vertex, std::vector<uint8_t>* bytes) {
    for (int c = 0; c < 3; ++c) AppendBytes(vertex.position[c], bytes);
    for (int c = 0; layout.normals && c < 3; ++c) AppendBytes(vertex.normal[c], bytes);
    if (layout.colors) AppendColor(vertex.rgb, bytes);
  };
}

json GlbBuffer::AddVertices(uint64_t count, const GlbLayout& layout,
                            const ModelSpool::Bounds& bounds) {
  const size_t view = AddView(count * layout.stride(), kArrayBuffer);
  views_.back()["byteStride"] = layout.stride();
  json attributes;
  json position = {{"componentType", kFloat}, {"type", "VEC3"}};
  position["min"] = Triple(bounds.low);
  position["max"] = Triple(bounds.high);
  attributes["POSITION"] = AddAccessor(view, 0, count, std::move(position));
  if (layout.normals) {
    attributes["NORMAL"] =
        AddAccessor(view, 12, count, {{"componentType", kFloat}, {"type", "VEC3"}});
  }
  if (layout.colors) {
    attributes["COLOR_0"] =
        AddAccessor(view, layout.normals ? 24 : 12, count,
                    {{"componentType", kUnsignedShort}, {"type", "VEC4"}, {"normalized", true}});
  }
  return attributes;
}

size_t GlbBuffer::AddIndices(uint64_t count, uint64_t index_bytes) {
  const size_t view = AddView(count * index_bytes, kElementArrayBuffer);
  return AddAccessor(
      view, 0, count,
      {{"componentType", index_bytes == 4 ? kUnsignedInt : kUnsignedShort}, {"type", "SCALAR"}});
}

void GlbBuffer::MoveTo(json* document) {
  if (size_ == 0) return;
  (*document)["buffers"] = {{{"byteLength", size_}}};
  (*document)["bufferViews"] = std::move(views_);
  (*document)["accessors"] = std::move(accessors_);
}

size_t GlbBuffer::AddView(uint64_t size, int target) {
  views_.push_back(
      {{"buffer", 0}, {"byteOffset", size_}, {"byteLength", size}, {"target", target}});
  size_ += (size + 3) / 4 * 4;
  return views_.size() - 1;
}

size_t GlbBuffer::AddAccessor(size_t view, uint64_t offset, uint64_t count, json accessor) {
  accessor["bufferView"] = view;
  accessor["byteOffset"] = offset;
  accessor["count"] = count;
  accessors_.push_back(std::move(accessor));
  return accessors_.size() - 1;
}

json GlbDocument() {
  return {{"asset", {{"version", "2.0"}, {"generator", "Veduta"}}}, {"scene", 0}};
}

void AddGlbMaterial(json* document) {
  (*document)["extensionsUsed"] = {"KHR_materials_unlit"};
  (*document)["materials"] = {
      {{"name", "vertex colours"},
       {"doubleSided", true},
       {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"roughnessFactor", 1}}},
       {"extensions", {{"KHR_materials_unlit", json::object()}}}}};
}

std::string GlbHead(const json& document, uint64_t binary_bytes) {
  std::string text = document.dump(-1, ' ', false, json::error_handler_t::replace);
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const uint64_t total = 12 + 8 + text.size() + (binary_bytes > 0 ? 8 + binary_bytes : 0);
  std::string head;
  const auto write = [&](std::initializer_list<uint64_t> words) {
    for (const uint64_t word : words) {
      const uint32_t value = static_cast<uint32_t>(word);
      head.append(reinterpret_cast<const char*>(&value), sizeof value);
    }
  };
  write({kMagic, kVersion, total, text.size(), kJsonChunk});
  head += text;
  if (binary_bytes > 0) write({binary_bytes, kBinaryChunk});
  return head;
}

}  // namespace veduta
