// SPDX-License-Identifier: Apache-2.0
#pragma once
// Writes a HEIC as iPhones do: a grid of equal tiles that are coded each by itself, cut to the
// picture's size. libheif 1.15 cannot write one, so its tiles are put into boxes of ours (ISO/IEC
// 23008-12 and 14496-12).

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "tests/engine/camera/modern_writer.h"

namespace veduta::testing {

inline std::string Number(size_t value, int size) {
  std::string bytes;
  for (int i = size - 1; i >= 0; --i) bytes.push_back(static_cast<char>(value >> (8 * i)));
  return bytes;
}
inline std::string BoxOf(const std::string& type, const std::string& content) {
  return Number(content.size() + 8, 4) + type + content;
}
inline std::string FullBoxOf(const std::string& type, int version, const std::string& content) {
  return BoxOf(type, Number(static_cast<size_t>(version) << 24, 4) + content);
}

// The box of this type wherever it lies, with its header.
inline std::string FindBox(const FileBytes& file, std::string_view type) {
  const std::string text(file.begin(), file.end());
  const size_t start = text.find(type) - 4;
  size_t size = 0;
  for (int i = 0; i < 4; ++i) size = size << 8 | file[start + i];
  return text.substr(start, size);
}

// The picture's part that a tile shows, its last row and column repeated beyond the border.
inline cv::Mat TileOf(const cv::Mat& bgr, int row, int column, int side_px) {
  cv::Mat tile(side_px, side_px, CV_8UC3);
  for (int v = 0; v < side_px; ++v) {
    for (int u = 0; u < side_px; ++u)
      tile.at<cv::Vec3b>(v, u) = bgr.at<cv::Vec3b>(std::min(row * side_px + v, bgr.rows - 1),
                                                   std::min(column * side_px + u, bgr.cols - 1));
  }
  return tile;
}

// `angle` turns the picture by so many quarters, anticlockwise, as `irot` has it.
inline FileBytes HeicGridFile(const cv::Mat& bgr, int tile_side_px, int angle = 0) {
  const int rows = (bgr.rows + tile_side_px - 1) / tile_side_px;
  const int columns = (bgr.cols + tile_side_px - 1) / tile_side_px;
  const int count = rows * columns, grid = count + 1;  // items are numbered from 1, the grid last
  std::string parameters;                              // of the coder, the same for all tiles
  std::vector<std::string> items;
  for (int i = 0; i < count; ++i) {
    const FileBytes tile = HeifFileOf(TileOf(bgr, i / columns, i % columns, tile_side_px));
    parameters = FindBox(tile, "hvcC");
    items.push_back(FindBox(tile, "mdat").substr(8));
  }
  items.push_back(Number(0, 2) + Number(rows - 1, 1) + Number(columns - 1, 1) +
                  Number(bgr.cols, 2) + Number(bgr.rows, 2));
  std::string infos = Number(grid, 2), needs = Number(grid, 2) + Number(count, 2);
  std::string associations = Number(grid, 4);
  for (int id = 1; id <= grid; ++id) {
    infos += FullBoxOf(
        "infe", 2, Number(id, 2) + Number(0, 2) + (id == grid ? "grid" : "hvc1") + Number(0, 1));
    if (id < grid) needs += Number(id, 2);
    // Properties by their place in ipco; 128: essential. The grid's size and turn, or a tile's
    // parameters and size.
    associations +=
        Number(id, 2) + Number(2, 1) +
        (id == grid ? Number(3, 1) + Number(128 + 4, 1) : Number(128 + 1, 1) + Number(2, 1));
  }
  const auto size_box = [](int width_px, int height_px) {
    return FullBoxOf("ispe", 0, Number(width_px, 4) + Number(height_px, 4));
  };
  const std::string properties =
      BoxOf("ipco", parameters + size_box(tile_side_px, tile_side_px) +
                        size_box(bgr.cols, bgr.rows) + BoxOf("irot", Number(angle, 1))) +
      FullBoxOf("ipma", 0, associations);
  const std::string type = BoxOf("ftyp", "heic" + Number(0, 4) + "mif1heic");
  const auto meta_of = [&](size_t data_start) {
    std::string places = Number(0x4400, 2) + Number(grid, 2);  // offsets and lengths of 4 bytes
    for (int id = 1; id <= grid; ++id) {
      places += Number(id, 2) + Number(0, 2) + Number(1, 2) + Number(data_start, 4) +
                Number(items[id - 1].size(), 4);
      data_start += items[id - 1].size();
    }
    return FullBoxOf("meta", 0,
                     FullBoxOf("hdlr", 0, Number(0, 4) + "pict" + std::string(13, '\0')) +
                         FullBoxOf("pitm", 0, Number(grid, 2)) + FullBoxOf("iinf", 0, infos) +
                         FullBoxOf("iref", 0, BoxOf("dimg", needs)) + BoxOf("iprp", properties) +
                         FullBoxOf("iloc", 0, places));
  };
  std::string data;
  for (const std::string& item : items) data += item;
  const size_t data_start = type.size() + meta_of(0).size() + 8;
  const std::string file = type + meta_of(data_start) + BoxOf("mdat", data);
  return {file.begin(), file.end()};
}

}  // namespace veduta::testing
