// SPDX-License-Identifier: Apache-2.0
#pragma once
// Writes TIFF files of every kind for the decoder's tests.

#include <tiffio.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <opencv2/core.hpp>
#include <vector>

#include "tests/engine/camera/photo_writer.h"

namespace veduta::testing {

struct TiffKind {
  int sample_count = 3;
  int bit_count = 8;
  int photometric = PHOTOMETRIC_RGB;
  int compression = COMPRESSION_NONE;
  int orientation = 0;  // 0: no tag
  bool is_tiled = false;
  bool is_planar = false;
  int rows_per_strip = 7;
  bool is_big_endian = false;
  int sample_format = SAMPLEFORMAT_UINT;
};

// Memory that libtiff writes to and reads back from while it does.
struct TiffMemory {
  FileBytes bytes;
  uint64_t next = 0;

  static tmsize_t Read(thandle_t handle, void* to, tmsize_t count) {
    auto* memory = static_cast<TiffMemory*>(handle);
    const uint64_t left =
        memory->next < memory->bytes.size() ? memory->bytes.size() - memory->next : 0;
    const uint64_t taken = std::min<uint64_t>(left, count);
    if (taken > 0) std::memcpy(to, memory->bytes.data() + memory->next, taken);
    memory->next += taken;
    return static_cast<tmsize_t>(taken);
  }
  static tmsize_t Write(thandle_t handle, void* from, tmsize_t count) {
    auto* memory = static_cast<TiffMemory*>(handle);
    memory->bytes.resize(std::max<uint64_t>(memory->bytes.size(), memory->next + count));
    if (count > 0) std::memcpy(memory->bytes.data() + memory->next, from, count);
    memory->next += count;
    return count;
  }
  static toff_t Seek(thandle_t handle, toff_t offset, int whence) {
    auto* memory = static_cast<TiffMemory*>(handle);
    memory->next = offset + (whence == SEEK_CUR   ? memory->next
                             : whence == SEEK_END ? memory->bytes.size()
                                                  : 0);
    return memory->next;
  }
  static int Close(thandle_t) { return 0; }
  static toff_t Size(thandle_t handle) { return static_cast<TiffMemory*>(handle)->bytes.size(); }
};

inline size_t TiffPixelBytes(const TiffKind& kind) {
  return size_t{1} * kind.sample_count * kind.bit_count / 8;
}

inline void SetTiffTags(TIFF* tiff, int width_px, int height_px, const TiffKind& kind) {
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, width_px);
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, height_px);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, kind.sample_count);
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, kind.bit_count);
  TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, kind.sample_format);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, kind.photometric);
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, kind.compression);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG,
               kind.is_planar ? PLANARCONFIG_SEPARATE : PLANARCONFIG_CONTIG);
  if (kind.orientation != 0) TIFFSetField(tiff, TIFFTAG_ORIENTATION, kind.orientation);
  if (kind.sample_count % 2 == 0) {
    uint16_t extra = EXTRASAMPLE_UNASSALPHA;
    TIFFSetField(tiff, TIFFTAG_EXTRASAMPLES, 1, &extra);
  }
  if (kind.photometric == PHOTOMETRIC_PALETTE) {
    std::vector<uint16_t> red(256), green(256), blue(256);
    for (int i = 0; i < 256; ++i) {
      red[i] = static_cast<uint16_t>(i * 257);
      green[i] = static_cast<uint16_t>((255 - i) * 257);
      blue[i] = static_cast<uint16_t>(i / 2 * 257);
    }
    TIFFSetField(tiff, TIFFTAG_COLORMAP, red.data(), green.data(), blue.data());
  }
}

inline void WriteTiffTiles(TIFF* tiff, int width_px, int height_px, const TiffKind& kind,
                           const std::vector<uint8_t>& rows) {
  const size_t pixel_bytes = TiffPixelBytes(kind), stride = width_px * pixel_bytes;
  TIFFSetField(tiff, TIFFTAG_TILEWIDTH, 32);
  TIFFSetField(tiff, TIFFTAG_TILELENGTH, 16);
  std::vector<uint8_t> tile(32 * 16 * pixel_bytes);
  for (int top = 0; top < height_px; top += 16) {
    for (int left = 0; left < width_px; left += 32) {
      const size_t count = std::min(32, width_px - left) * pixel_bytes;
      for (int v = top; v < std::min(top + 16, height_px); ++v) {
        std::memcpy(tile.data() + (v - top) * 32 * pixel_bytes,
                    rows.data() + v * stride + left * pixel_bytes, count);
      }
      TIFFWriteTile(tiff, tile.data(), left, top, 0, 0);
    }
  }
}

inline void WriteTiffStrips(TIFF* tiff, int width_px, int height_px, const TiffKind& kind,
                            const std::vector<uint8_t>& rows) {
  const size_t pixel_bytes = TiffPixelBytes(kind), stride = width_px * pixel_bytes;
  const int sample_bytes = kind.bit_count / 8;
  TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, kind.rows_per_strip);
  for (int plane = 0; plane < (kind.is_planar ? kind.sample_count : 1); ++plane) {
    for (int v = 0; v < height_px; ++v) {
      std::vector<uint8_t> row(rows.begin() + v * stride, rows.begin() + (v + 1) * stride);
      for (int u = 0; kind.is_planar && u < width_px; ++u) {
        std::memcpy(row.data() + u * sample_bytes,
                    rows.data() + v * stride + u * pixel_bytes + plane * sample_bytes,
                    sample_bytes);
      }
      TIFFWriteScanline(tiff, row.data(), v, static_cast<uint16_t>(plane));
    }
  }
}

// `rows`: contiguous samples in the machine's byte order, 8 or 16 bits. Tiles are 32 x 16 px.
inline FileBytes TiffFile(int width_px, int height_px, const TiffKind& kind,
                          const std::vector<uint8_t>& rows) {
  TiffMemory memory;
  TIFF* tiff = TIFFClientOpen("test", kind.is_big_endian ? "wb" : "wl", &memory, TiffMemory::Read,
                              TiffMemory::Write, TiffMemory::Seek, TiffMemory::Close,
                              TiffMemory::Size, nullptr, nullptr);
  SetTiffTags(tiff, width_px, height_px, kind);
  (kind.is_tiled ? WriteTiffTiles : WriteTiffStrips)(tiff, width_px, height_px, kind, rows);
  TIFFClose(tiff);
  return memory.bytes;
}

inline FileBytes TiffFile(const cv::Mat& bgr, const TiffKind& kind = {}) {
  return TiffFile(bgr.cols, bgr.rows, kind, RgbRows(bgr));
}

}  // namespace veduta::testing
