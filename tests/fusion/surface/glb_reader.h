// SPDX-License-Identifier: Apache-2.0
#pragma once
// Reads binary glTF 2.0 and holds it against the specification: chunks, offsets, strides,
// alignment, bounds. Written apart from the writer.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

namespace veduta {

inline std::vector<uint8_t> ReadBytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class GlbFile final {
 public:
  explicit GlbFile(const std::string& path) : GlbFile(ReadBytes(path)) {}
  explicit GlbFile(std::vector<uint8_t> bytes) : bytes_(std::move(bytes)) {
    EXPECT_GE(bytes_.size(), 20u);
    EXPECT_EQ(std::string(bytes_.begin(), bytes_.begin() + 4), "glTF");
    EXPECT_EQ(Word(4), 2u);
    EXPECT_EQ(Word(8), bytes_.size());
    const uint32_t text = Word(12);
    EXPECT_EQ(text % 4, 0u);
    EXPECT_EQ(Word(16), 0x4E4F534Au);
    json = nlohmann::json::parse(bytes_.begin() + 20, bytes_.begin() + 20 + text);
    EXPECT_EQ(json["asset"]["version"], "2.0");
    if (20 + text == bytes_.size()) {
      EXPECT_FALSE(json.contains("buffers"));
      return;
    }
    const uint32_t size = Word(20 + text);
    EXPECT_EQ(Word(24 + text), 0x004E4942u);
    EXPECT_EQ(size % 4, 0u);
    start_ = 28 + text;
    EXPECT_EQ(start_ + size, bytes_.size());
    EXPECT_EQ(json["buffers"].size(), 1u);
    EXPECT_EQ(json["buffers"][0]["byteLength"], size);
    CheckViews(size);
  }

  // Accessor `index` as numbers, its bounds and layout checked; normalized integers as fractions.
  std::vector<std::vector<double>> Read(size_t index) const {
    const auto& accessor = json["accessors"][index];
    const auto& view = json["bufferViews"][accessor["bufferView"].get<size_t>()];
    const int type = accessor["componentType"];
    const size_t size = type == 5126 || type == 5125 ? 4 : type == 5123 ? 2 : 1;
    const std::string shape = accessor["type"];
    const size_t parts = shape == "SCALAR" ? 1 : shape == "VEC3" ? 3 : shape == "VEC4" ? 4 : 0;
    EXPECT_GT(parts, 0u);
    const size_t count = accessor["count"], stride = view.value("byteStride", size * parts);
    const size_t offset = accessor.value("byteOffset", size_t{0}),
                 begin = view.value("byteOffset", size_t{0});
    EXPECT_GT(count, 0u);
    EXPECT_EQ((begin + offset) % size, 0u);
    EXPECT_EQ(stride % (view["target"] == 34962 ? 4 : size), 0u);
    EXPECT_LE(offset + stride * (count - 1) + size * parts, view["byteLength"].get<size_t>());
    std::vector<std::vector<double>> rows(count, std::vector<double>(parts));
    for (size_t i = 0; i < count; ++i) {
      for (size_t k = 0; k < parts; ++k) {
        const uint8_t* const at = bytes_.data() + start_ + begin + offset + i * stride + k * size;
        rows[i][k] = Number(at, type);
        if (accessor.value("normalized", false)) rows[i][k] /= type == 5123 ? 65535 : 255;
      }
    }
    CheckBounds(accessor, rows);
    return rows;
  }

  nlohmann::json json;

 private:
  uint32_t Word(size_t at) const {
    uint32_t word;
    std::memcpy(&word, bytes_.data() + at, 4);
    return word;
  }

  static double Number(const uint8_t* at, int type) {
    float real;
    uint32_t word;
    uint16_t half;
    std::memcpy(&half, at, 2);
    if (type == 5123) return half;
    std::memcpy(&real, at, 4);
    std::memcpy(&word, at, 4);
    return type == 5126 ? real : word;
  }

  void CheckViews(size_t size) const {
    size_t end = 0;
    for (const auto& view : json["bufferViews"]) {
      end = (end + 3) / 4 * 4;
      EXPECT_EQ(view["byteOffset"], end);  // no gap but to a multiple of 4, no overlap
      end += view["byteLength"].get<size_t>();
      if (view.contains("byteStride")) {
        EXPECT_EQ(view["target"], 34962);
        EXPECT_GE(view["byteStride"], 4);
        EXPECT_LE(view["byteStride"], 252);
      } else {
        EXPECT_EQ(view["target"], 34963);
      }
    }
    EXPECT_EQ((end + 3) / 4 * 4, size);
  }

  static void CheckBounds(const nlohmann::json& accessor,
                          const std::vector<std::vector<double>>& rows) {
    if (!accessor.contains("min")) return;
    for (size_t k = 0; k < rows[0].size(); ++k) {
      double low = rows[0][k], high = low;
      for (const auto& row : rows) low = std::min(low, row[k]), high = std::max(high, row[k]);
      EXPECT_EQ(accessor["min"][k].get<double>(), low);
      EXPECT_EQ(accessor["max"][k].get<double>(), high);
    }
  }

  const std::vector<uint8_t> bytes_;
  size_t start_ = 0;
};

}  // namespace veduta
