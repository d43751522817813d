// SPDX-License-Identifier: Apache-2.0
#include <tiffio.h>

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string_view>
#include <vector>

#include "engine/camera/pixel_decoders.h"

namespace veduta {
namespace {

// libtiff's view of the file, and where its first complaint goes.
struct Source {
  std::span<const uint8_t> bytes;
  uint64_t next = 0;
  std::string error{};
};

tmsize_t Read(thandle_t handle, void* to, tmsize_t count) {
  auto* source = static_cast<Source*>(handle);
  const uint64_t left =
      source->next < source->bytes.size() ? source->bytes.size() - source->next : 0;
  const uint64_t taken = std::min(left, static_cast<uint64_t>(std::max<tmsize_t>(count, 0)));
  if (taken > 0) std::memcpy(to, source->bytes.data() + source->next, taken);
  source->next += taken;
  return static_cast<tmsize_t>(taken);
}
tmsize_t RefuseToWrite(thandle_t, void*, tmsize_t) {
  return 0;
}
toff_t Seek(thandle_t handle, toff_t offset, int whence) {
  auto* source = static_cast<Source*>(handle);
  const uint64_t base = whence == SEEK_CUR   ? source->next
                        : whence == SEEK_END ? source->bytes.size()
                                             : 0;
  source->next = base + offset;
  return source->next;
}
int Close(thandle_t) {
  return 0;
}
toff_t Size(thandle_t handle) {
  return static_cast<Source*>(handle)->bytes.size();
}
int Map(thandle_t handle, void** base, toff_t* size) {
  const auto* source = static_cast<Source*>(handle);
  *base = const_cast<uint8_t*>(
      source->bytes.data());  // opened for reading: libtiff copies before it changes bytes
  *size = source->bytes.size();
  return 1;
}
void Unmap(thandle_t, void*, toff_t) {}

// Returning 1 keeps libtiff from printing.
int KeepError(TIFF*, void* user_data, const char*, const char* format, va_list arguments) {
  auto* source = static_cast<Source*>(user_data);
  if (source->error.empty()) {
    char text[160];
    std::vsnprintf(text, sizeof(text), format, arguments);
    source->error = text;
  }
  return 1;
}
int DropWarning(TIFF*, void*, const char*, const char*, va_list) {
  return 1;
}

// libtiff's words where malloc has returned nothing; it has no hook for its allocations. What a
// damaged file may ask for is bounded before (Open), with other words.
bool IsShortage(std::string_view error) {
  if (error.find("beyond the") != std::string_view::npos) return false;
  for (const char* const words : {"emory", "No space", "llocate"}) {
    if (error.find(words) != std::string_view::npos) return true;
  }
  return false;
}

struct CloseTiff {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};
using Tiff = std::unique_ptr<TIFF, CloseTiff>;

Tiff Open(Source* source, const ImageSize& size) {
  // A strip or tile may hold the whole picture, at most 8 bytes a pixel; tags need little.
  const uint64_t bytes_max = 8 * size.pixel_count() + (16 << 20);
  TIFFOpenOptions* const options = TIFFOpenOptionsAlloc();
  if (options == nullptr) return nullptr;
  TIFFOpenOptionsSetMaxSingleMemAlloc(options, static_cast<tmsize_t>(bytes_max));
  TIFFOpenOptionsSetErrorHandlerExtR(options, KeepError, source);
  TIFFOpenOptionsSetWarningHandlerExtR(options, DropWarning, source);
  // With Map, because libtiff 4.5.0 refuses sound uncompressed tiles that it has to read into its
  // own, rounded, buffer.
  Tiff tiff(TIFFClientOpenExt("photo", "r", source, Read, RefuseToWrite, Seek, Close, Size, Map,
                              Unmap, options));
  TIFFOpenOptionsFree(options);
  return tiff;
}

uint16_t ShortTag(TIFF* tiff, uint32_t tag, uint16_t otherwise) {
  uint16_t value = otherwise;
  return TIFFGetFieldDefaulted(tiff, tag, &value) == 1 ? value : otherwise;
}

// Why a sound file of this kind is not decoded; empty if it is. Few compressions are allowed: a
// photo needs no more, and each is a decoder that hostile bytes would reach.
std::string Unsupported(TIFF* tiff) {
  const uint16_t bits = ShortTag(tiff, TIFFTAG_BITSPERSAMPLE, 1);
  const uint16_t samples = ShortTag(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
  const uint16_t photometric = ShortTag(tiff, TIFFTAG_PHOTOMETRIC, 0xFFFF);
  const uint16_t compression = ShortTag(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE);
  const bool is_gray =
      photometric == PHOTOMETRIC_MINISBLACK || photometric == PHOTOMETRIC_MINISWHITE;
  const bool is_rgb = photometric == PHOTOMETRIC_RGB;
  const bool is_palette = photometric == PHOTOMETRIC_PALETTE;
  if (compression != COMPRESSION_NONE && compression != COMPRESSION_LZW &&
      compression != COMPRESSION_ADOBE_DEFLATE && compression != COMPRESSION_DEFLATE &&
      compression != COMPRESSION_PACKBITS) {
    return "compression " + std::to_string(compression) +
           " (none, LZW, Deflate and PackBits are read)";
  }
  if (ShortTag(tiff, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT) != SAMPLEFORMAT_UINT)
    return "samples that are no whole numbers";
  if (bits != 8 && !(bits == 16 && !is_palette)) return std::to_string(bits) + " bits a sample";
  if (!is_gray && !is_rgb && !is_palette)
    return "colours of kind " + std::to_string(photometric) + " (grey, palette and RGB are read)";
  const bool is_planar =
      ShortTag(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) != PLANARCONFIG_CONTIG;
  const int color_count = is_rgb ? 3 : 1;
  const int alpha_max = is_palette || (is_gray && is_planar) ? 0 : 1;
  if (samples < color_count || samples > color_count + alpha_max)
    return std::to_string(samples) + " samples a pixel";
  return "";
}

// Rows that are decoded at a time: whole strips or tiles, about 64 rows, so that the scratch stays
// small. 64 is chosen by hand.
uint32_t BandHeight(TIFF* tiff, uint32_t height_px) {
  uint32_t unit = 0;
  if (TIFFIsTiled(tiff) != 0) {
    TIFFGetField(tiff, TIFFTAG_TILELENGTH, &unit);
  } else {
    TIFFGetFieldDefaulted(tiff, TIFFTAG_ROWSPERSTRIP, &unit);
  }
  if (unit == 0 || unit >= height_px) return height_px;
  return unit * std::max(1u, 64 / unit);
}

// libtiff's converter gives 0xAABBGGRR, 16 bits rounded to 8. False on any error.
bool ReadBands(TIFF* tiff, cv::Mat* bgr) {
  char message[1024] = "";
  TIFFRGBAImage image;
  if (TIFFRGBAImageBegin(&image, tiff, 1, message) == 0) return false;
  image.req_orientation = ORIENTATION_TOPLEFT;
  const auto width = static_cast<uint32_t>(bgr->cols);
  const auto height = static_cast<uint32_t>(bgr->rows);
  const uint32_t band_height = BandHeight(tiff, height);
  std::vector<uint32_t> raster(size_t{width} * std::min(band_height, height));
  bool is_good = image.width == width && image.height == height;
  for (uint32_t top = 0; is_good && top < height; top += band_height) {
    const uint32_t row_count = std::min(band_height, height - top);
    image.row_offset = static_cast<int>(top);
    image.col_offset = 0;
    is_good = TIFFRGBAImageGet(&image, raster.data(), width, row_count) != 0;
    for (uint32_t row = 0; is_good && row < row_count; ++row) {
      const uint32_t* from = raster.data() + size_t{row} * width;
      uint8_t* to = bgr->ptr(static_cast<int>(top + row));
      for (uint32_t u = 0; u < width; ++u, to += 3) {
        to[0] = static_cast<uint8_t>(TIFFGetB(from[u]));
        to[1] = static_cast<uint8_t>(TIFFGetG(from[u]));
        to[2] = static_cast<uint8_t>(TIFFGetR(from[u]));
      }
    }
  }
  TIFFRGBAImageEnd(&image);
  return is_good;
}

}  // namespace

Pixels DecodeTiffPixels(std::span<const uint8_t> bytes, const PhotoHeader& header) {
  Source source{bytes};
  const auto damaged = [&source](const char* otherwise) {
    if (IsShortage(source.error)) return Pixels{PixelOutcome::kNoMemory, "", {}};
    return Pixels{PixelOutcome::kUnreadable,
                  "the TIFF is cut short or damaged (" +
                      (source.error.empty() ? otherwise : source.error) + ")",
                  {}};
  };
  const Tiff tiff = Open(&source, header.stored_size);
  if (tiff == nullptr) return damaged("it has no directory");
  ImageSize size;
  if (TIFFGetField(tiff.get(), TIFFTAG_IMAGEWIDTH, &size.width_px) != 1 ||
      TIFFGetField(tiff.get(), TIFFTAG_IMAGELENGTH, &size.height_px) != 1 ||
      size != header.stored_size) {
    return damaged("its size is ambiguous");
  }
  if (const std::string reason = Unsupported(tiff.get()); !reason.empty()) {
    return {PixelOutcome::kUnsupportedFormat,
            "a TIFF with " + reason + "; save it as an 8-bit RGB TIFF, PNG or JPEG",
            {}};
  }
  // The pixels are wanted as stored: alpha ignored (an associated one is not multiplied in again)
  // and nothing turned.
  const uint16_t alpha = EXTRASAMPLE_ASSOCALPHA;
  const bool has_alpha = ShortTag(tiff.get(), TIFFTAG_SAMPLESPERPIXEL, 1) % 2 == 0;
  if (has_alpha) TIFFSetField(tiff.get(), TIFFTAG_EXTRASAMPLES, 1, &alpha);
  TIFFSetField(tiff.get(), TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT);
  if (source.error.empty()) {
    cv::Mat bgr(static_cast<int>(size.height_px), static_cast<int>(size.width_px), CV_8UC3);
    if (ReadBands(tiff.get(), &bgr) && source.error.empty())
      return {PixelOutcome::kDecoded, "", std::move(bgr)};
  }
  return damaged("its pixels cannot be read");
}

}  // namespace veduta
