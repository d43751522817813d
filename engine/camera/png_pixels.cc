// SPDX-License-Identifier: Apache-2.0
#include <png.h>

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "engine/camera/pixel_decoders.h"

namespace veduta {
namespace {

// Bytes of one chunk other than the picture's; chosen by hand.
constexpr png_alloc_size_t kChunkSizeMax = 8 << 20;

// libpng's view of the file, and where its complaint goes.
struct Source {
  std::span<const uint8_t> bytes;
  size_t next = 0;
  std::array<char, 128> error{};
  bool is_memory_short = false;
};

// libpng and its zlib allocate by these. What a damaged file may ask for is bounded before
// (png_set_user_limits, png_set_chunk_malloc_max).
png_voidp Allocate(png_structp png, png_alloc_size_t size) {
  void* const memory = std::malloc(size);
  if (memory == nullptr) static_cast<Source*>(png_get_mem_ptr(png))->is_memory_short = true;
  return memory;
}
void Free(png_structp, png_voidp memory) {
  std::free(memory);
}

void Read(png_structp png, png_bytep to, size_t count) {
  auto* source = static_cast<Source*>(png_get_io_ptr(png));
  if (count > source->bytes.size() - source->next) png_error(png, "the file ends early");
  std::memcpy(to, source->bytes.data() + source->next, count);
  source->next += count;
}

[[noreturn]] void KeepError(png_structp png, png_const_charp message) {
  auto* source = static_cast<Source*>(png_get_error_ptr(png));
  std::strncpy(source->error.data(), message, source->error.size() - 1);
  png_longjmp(png, 1);
}

void DropWarning(png_structp, png_const_charp) {}

// Everything becomes 8-bit BGR: palettes and few bits are spread out, 16 bits rounded, alpha
// dropped. Colour profiles and gamma are left alone, as in JPEG.
void AskForBgr(png_structp png, png_infop info) {
  const png_byte color_type = png_get_color_type(png, info);
  if (color_type == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png);
  if (color_type == PNG_COLOR_TYPE_GRAY) png_set_expand_gray_1_2_4_to_8(png);
  if (png_get_bit_depth(png, info) == 16) png_set_scale_16(png);
  png_set_strip_alpha(png);
  if ((color_type & PNG_COLOR_MASK_COLOR) == 0) png_set_gray_to_rgb(png);
  png_set_bgr(png);
}

// libpng's errors jump out of this function, so it must hold nothing that has a destructor.
bool ReadRows(Source* source, const ImageSize& size, png_bytepp rows) {
  png_structp const png = png_create_read_struct_2(PNG_LIBPNG_VER_STRING, source, KeepError,
                                                   DropWarning, source, Allocate, Free);
  if (png == nullptr) return false;
  png_infop const info = png_create_info_struct(png);
  if (info == nullptr || setjmp(png_jmpbuf(png)) != 0) {
    png_structp doomed = png;
    png_infop doomed_info = info;
    png_destroy_read_struct(&doomed, &doomed_info, nullptr);
    return false;
  }
  png_set_read_fn(png, source, Read);
  png_set_user_limits(png, size.width_px, size.height_px);
  png_set_chunk_malloc_max(png, kChunkSizeMax);
  // Texts and profiles are skipped, so that nothing but the picture is ever inflated.
  png_set_keep_unknown_chunks(png, PNG_HANDLE_CHUNK_NEVER, nullptr, -1);
  png_read_info(png, info);
  AskForBgr(png, info);
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
  if (png_get_image_width(png, info) != size.width_px ||
      png_get_image_height(png, info) != size.height_px ||
      png_get_rowbytes(png, info) != size_t{3} * size.width_px) {
    png_error(png, "the rows are not what the header says");
  }
  png_read_image(png, rows);
  png_read_end(png, nullptr);
  png_structp done = png;
  png_infop done_info = info;
  png_destroy_read_struct(&done, &done_info, nullptr);
  return true;
}

}  // namespace

Pixels DecodePngPixels(std::span<const uint8_t> bytes, const PhotoHeader& header) {
  cv::Mat bgr(static_cast<int>(header.stored_size.height_px),
              static_cast<int>(header.stored_size.width_px), CV_8UC3);
  std::vector<png_bytep> rows(header.stored_size.height_px);
  for (size_t v = 0; v < rows.size(); ++v) rows[v] = bgr.ptr(static_cast<int>(v));
  Source source{bytes};
  if (!ReadRows(&source, header.stored_size, rows.data())) {
    if (source.is_memory_short) return {PixelOutcome::kNoMemory, "", {}};
    return {PixelOutcome::kUnreadable,
            std::string("the PNG is cut short or damaged (") + source.error.data() + ")",
            {}};
  }
  return {PixelOutcome::kDecoded, "", std::move(bgr)};
}

}  // namespace veduta
