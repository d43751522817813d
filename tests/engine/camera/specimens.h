// SPDX-License-Identifier: Apache-2.0
#pragma once
// The same picture as a file of every kind that is read.

#include <algorithm>
#include <string>
#include <vector>

#include "tests/engine/camera/heif_grid_writer.h"
#include "tests/engine/camera/modern_writer.h"
#include "tests/engine/camera/photo_writer.h"
#include "tests/engine/camera/tiff_writer.h"

namespace veduta::testing {

struct Specimen {
  std::string name;
  FileBytes bytes;
};

inline std::vector<Specimen> Specimens(int width_px, int height_px) {
  const cv::Mat picture = TestPicture(width_px, height_px);
  std::vector<Specimen> specimens = {
      {"baseline JPEG", JpegFile(picture)},
      {"progressive JPEG", JpegFile(picture, TJFLAG_PROGRESSIVE)},
      {"grey JPEG", JpegFile(picture, 0, TJSAMP_GRAY)},
      {"JPEG with EXIF", WithExif(JpegFile(picture), ExifBlock(6, true))},
      {"PNG", PngFile(picture)},
      {"interlaced PNG with EXIF", PngFile(picture, true, 8)},
      {"WebP with EXIF", WebpFile(picture, false, ExifBlock(6, true))},
      {"lossless WebP", WebpFile(picture, true)},
      {"HEIC with EXIF", HeifFileOf(picture, {.orientation = heif_orientation_rotate_90_cw,
                                              .exif = ExifBlock(6, true)})},
  };
  if (width_px <= 160) {  // x265 takes long for larger tiles
    const int tile_side_px = std::max(32, (width_px / 2 + 15) / 16 * 16);
    specimens.push_back({"HEIC of tiles", HeicGridFile(picture, tile_side_px)});
  }
  for (const int compression :
       {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE, COMPRESSION_PACKBITS}) {
    for (const bool is_tiled : {false, true}) {
      TiffKind kind;
      kind.compression = compression;
      kind.is_tiled = is_tiled;
      kind.orientation = 6;
      specimens.push_back(
          {"TIFF, compression " + std::to_string(compression) + (is_tiled ? ", tiled" : ""),
           TiffFile(picture, kind)});
    }
  }
  return specimens;
}

}  // namespace veduta::testing
