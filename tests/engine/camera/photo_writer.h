// SPDX-License-Identifier: Apache-2.0
#pragma once
// Writes the photo files that the decoder's tests read: pictures from a formula, in every format
// (TIFF: tiff_writer.h) and with any tags.

#include <png.h>
#include <turbojpeg.h>

#include <csetjmp>
#include <cstdint>
#include <initializer_list>
#include <opencv2/core.hpp>
#include <vector>

namespace veduta::testing {

using FileBytes = std::vector<uint8_t>;

// A smooth colour picture without any symmetry, so that every way to turn it gives another one.
inline cv::Mat TestPicture(int width_px, int height_px) {
  cv::Mat bgr(height_px, width_px, CV_8UC3);
  for (int v = 0; v < height_px; ++v) {
    for (int u = 0; u < width_px; ++u) {
      const int bump = (u / 8 + v / 8) % 2 * 16;
      bgr.at<cv::Vec3b>(v, u) = cv::Vec3b(
          static_cast<uint8_t>(20 + 200 * u / width_px),
          static_cast<uint8_t>(30 + 190 * v / height_px),
          static_cast<uint8_t>(40 + 90 * (u + 2 * v) / (width_px + 2 * height_px) + bump));
    }
  }
  return bgr;
}

inline FileBytes JpegFile(const cv::Mat& bgr, int flags = 0, int subsampling = TJSAMP_420,
                          int quality = 92) {
  tjhandle handle = tjInitCompress();
  unsigned char* buffer = nullptr;
  unsigned long size = 0;
  tjCompress2(handle, bgr.data, bgr.cols, static_cast<int>(bgr.step[0]), bgr.rows, TJPF_BGR,
              &buffer, &size, subsampling, quality, flags);
  FileBytes bytes(buffer, buffer + size);
  tjFree(buffer);
  tjDestroy(handle);
  return bytes;
}

inline FileBytes CmykJpegFile(int width_px, int height_px) {
  std::vector<uint8_t> cmyk(size_t{4} * width_px * height_px, 77);
  tjhandle handle = tjInitCompress();
  unsigned char* buffer = nullptr;
  unsigned long size = 0;
  tjCompress2(handle, cmyk.data(), width_px, 4 * width_px, height_px, TJPF_CMYK, &buffer, &size,
              TJSAMP_444, 90, 0);
  FileBytes bytes(buffer, buffer + size);
  tjFree(buffer);
  tjDestroy(handle);
  return bytes;
}

inline void Append(FileBytes* bytes, std::initializer_list<int> more) {
  for (const int byte : more) bytes->push_back(static_cast<uint8_t>(byte));
}

// A TIFF structure, in either byte order, that holds an orientation after another tag.
inline FileBytes ExifBlock(int orientation, bool is_little_endian) {
  FileBytes exif;
  if (is_little_endian) {
    Append(&exif, {'I', 'I', 42, 0, 8, 0, 0, 0, 2, 0});
    Append(&exif, {0x0F, 0x01, 2, 0, 2, 0, 0, 0, 'A', 0, 0, 0});
    Append(&exif, {0x12, 0x01, 3, 0, 1, 0, 0, 0, orientation, 0, 0, 0, 0, 0, 0, 0});
  } else {
    Append(&exif, {'M', 'M', 0, 42, 0, 0, 0, 8, 0, 2});
    Append(&exif, {0x01, 0x0F, 0, 2, 0, 0, 0, 2, 'A', 0, 0, 0});
    Append(&exif, {0x01, 0x12, 0, 3, 0, 0, 0, 1, 0, orientation, 0, 0, 0, 0, 0, 0});
  }
  return exif;
}

// The JPEG with a segment put right behind its start.
inline FileBytes WithSegment(const FileBytes& jpeg, int marker, const FileBytes& payload) {
  FileBytes bytes(jpeg.begin(), jpeg.begin() + 2);
  const int length = static_cast<int>(payload.size()) + 2;
  Append(&bytes, {0xFF, marker, length >> 8, length & 0xFF});
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  bytes.insert(bytes.end(), jpeg.begin() + 2, jpeg.end());
  return bytes;
}

inline FileBytes WithExif(const FileBytes& jpeg, const FileBytes& exif) {
  FileBytes payload = {'E', 'x', 'i', 'f', 0, 0};
  payload.insert(payload.end(), exif.begin(), exif.end());
  return WithSegment(jpeg, 0xE1, payload);
}

struct PngKind {
  int color_type = PNG_COLOR_TYPE_RGB;
  int bit_depth = 8;
  bool is_interlaced = false;
  int exif_orientation = 0;  // 0: no eXIf chunk
};

// `rows` holds the samples as PNG wants them for this kind (RGB order, 16 bits big-endian). A
// palette file maps index i to (i, 255 - i, i / 2).
inline FileBytes PngFile(int width_px, int height_px, const PngKind& kind,
                         const std::vector<uint8_t>& rows) {
  FileBytes bytes;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_set_write_fn(
      png, &bytes,
      [](png_structp p, png_bytep data, size_t size) {
        auto* to = static_cast<FileBytes*>(png_get_io_ptr(p));
        to->insert(to->end(), data, data + size);
      },
      [](png_structp) {});
  png_set_IHDR(png, info, width_px, height_px, kind.bit_depth, kind.color_type,
               kind.is_interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (kind.color_type == PNG_COLOR_TYPE_PALETTE) {
    std::vector<png_color> palette(size_t{1} << kind.bit_depth);
    for (size_t i = 0; i < palette.size(); ++i) {
      palette[i] = {static_cast<png_byte>(i), static_cast<png_byte>(255 - i),
                    static_cast<png_byte>(i / 2)};
    }
    png_set_PLTE(png, info, palette.data(), static_cast<int>(palette.size()));
  }
  FileBytes exif = ExifBlock(kind.exif_orientation, false);
  if (kind.exif_orientation != 0)
    png_set_eXIf_1(png, info, static_cast<png_uint_32>(exif.size()), exif.data());
  png_write_info(png, info);
  const size_t stride = rows.size() / height_px;
  std::vector<png_bytep> pointers(height_px);
  for (int v = 0; v < height_px; ++v) pointers[v] = const_cast<png_bytep>(rows.data() + v * stride);
  png_write_image(png, pointers.data());
  png_write_end(png, nullptr);  // with info it would write eXIf again
  png_destroy_write_struct(&png, &info);
  return bytes;
}

// The picture's samples in RGB order, row by row.
inline std::vector<uint8_t> RgbRows(const cv::Mat& bgr) {
  std::vector<uint8_t> rows;
  for (int v = 0; v < bgr.rows; ++v) {
    for (int u = 0; u < bgr.cols; ++u) {
      const cv::Vec3b px = bgr.at<cv::Vec3b>(v, u);
      rows.insert(rows.end(), {px[2], px[1], px[0]});
    }
  }
  return rows;
}

inline FileBytes PngFile(const cv::Mat& bgr, bool is_interlaced = false, int exif_orientation = 0) {
  return PngFile(bgr.cols, bgr.rows, {PNG_COLOR_TYPE_RGB, 8, is_interlaced, exif_orientation},
                 RgbRows(bgr));
}

}  // namespace veduta::testing
