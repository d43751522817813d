// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/heif_file.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "engine/camera/heif_references.h"
#include "engine/camera/hevc_decoder.h"

namespace veduta {
namespace {

// Of what a block of EXIF has at most in a JPEG; and of the offset that HEIF puts in front of it.
constexpr size_t kExifSizeMax = 1 << 16;
constexpr size_t kOffsetSize = 4;
// As DecodeLimits::side_px_max may be at most: no picture of a file is larger, not only the one
// that is decoded.
constexpr int kSideMax = 65535;
// Codecs pad to whole blocks of at most 64 px, and a tile may be larger than the picture that it is
// cut to: iPhones' tiles have 512 x 512 px.
constexpr int kTileSideMax = 2048;

// Whether the box of the file's type, which comes first, starts with this brand.
bool HasBrand(std::span<const uint8_t> bytes, std::string_view brand) {
  return bytes.size() >= 12 && std::equal(brand.begin(), brand.end(), bytes.begin() + 8);
}
bool IsAvif(std::span<const uint8_t> bytes) {
  return HasBrand(bytes, "avif") || HasBrand(bytes, "avis");
}

}  // namespace

HeifFailure FailureOf(const heif_error& error) {
  std::string detail = error.message != nullptr ? error.message : "libheif says no more";
  detail = "(" + detail.substr(0, detail.find_last_not_of(" \n") + 1) + ")";
  switch (error.code) {
    case heif_error_Ok:
      return {};
    case heif_error_Memory_allocation_error:
      // libheif calls a size over its limits so, too: that is no shortage.
      if (error.subcode != heif_suberror_Security_limit_exceeded)
        return {HeifOutcome::kNoMemory, {}};
      return {HeifOutcome::kUnreadable, "the HEIF claims more than any photo has " + detail};
    case heif_error_Unsupported_filetype:
    case heif_error_Unsupported_feature:
      return {HeifOutcome::kUnsupported,
              "a HEIF of a kind that is not read " + detail + "; save it as a JPEG"};
    default:
      return {HeifOutcome::kUnreadable, "the HEIF is cut short or damaged " + detail};
  }
}

ImageSize HeifFile::Size() const {
  const int width_px = heif_image_handle_get_width(primary.get());
  const int height_px = heif_image_handle_get_height(primary.get());
  return {static_cast<uint32_t>(std::max(0, width_px)),
          static_cast<uint32_t>(std::max(0, height_px))};
}

std::vector<uint8_t> HeifFile::Exif() const {
  heif_item_id id = 0;
  if (heif_image_handle_get_list_of_metadata_block_IDs(primary.get(), "Exif", &id, 1) != 1)
    return {};
  const size_t size = heif_image_handle_get_metadata_size(primary.get(), id);
  if (size <= kOffsetSize || size > kExifSizeMax) return {};
  std::vector<uint8_t> block(size);
  if (heif_image_handle_get_metadata(primary.get(), id, block.data()).code != heif_error_Ok)
    return {};
  const size_t offset = size_t{block[0]} << 24 | block[1] << 16 | block[2] << 8 | block[3];
  if (offset >= size - kOffsetSize) return {};
  block.erase(block.begin(), block.begin() + static_cast<ptrdiff_t>(kOffsetSize + offset));
  return block;
}

uint64_t HeifFile::PixelCount() const {
  const int width_px = heif_image_handle_get_ispe_width(primary.get());
  const int height_px = heif_image_handle_get_ispe_height(primary.get());
  const uint64_t declared =
      static_cast<uint64_t>(std::max(0, width_px)) * static_cast<uint64_t>(std::max(0, height_px));
  return std::max(declared, Size().pixel_count());
}

uint64_t HeifFile::CodedPixelsMax() const {
  return 2 * PixelCount() + uint64_t{kTileSideMax} * kTileSideMax;
}

int HeifFile::CanvasSideMax() const {
  const ImageSize size = Size();
  const int side = static_cast<int>(std::max(size.width_px, size.height_px));
  return std::max({heif_image_handle_get_ispe_width(primary.get()),
                   heif_image_handle_get_ispe_height(primary.get()), side, kTileSideMax});
}

bool IsHeif(std::span<const uint8_t> bytes) {
  // libheif says "maybe" to anything that is too short to tell.
  constexpr std::string_view kFileType = "ftyp";
  if (bytes.size() < 12 || !std::equal(kFileType.begin(), kFileType.end(), bytes.begin() + 4))
    return false;
  const auto type =
      heif_check_filetype(bytes.data(), static_cast<int>(std::min<size_t>(bytes.size(), 64)));
  return type == heif_filetype_yes_supported || type == heif_filetype_yes_unsupported ||
         type == heif_filetype_maybe;
}

HeifFile OpenHeif(std::span<const uint8_t> bytes) {
  HeifFile file;
  if (IsAvif(bytes)) {
    file.failure = {HeifOutcome::kUnsupported, "an AVIF; save it as a JPEG"};
    return file;
  }
  if (HasEndlessReferences(bytes)) {
    file.failure = {HeifOutcome::kUnreadable, "the HEIF's pictures are made of each other"};
    return file;
  }
  RegisterHevcDecoder();
  file.context.reset(heif_context_alloc());
  if (!file.context) {
    file.failure.outcome = HeifOutcome::kNoMemory;
    return file;
  }
  heif_context_set_maximum_image_size_limit(file.context.get(), kSideMax);
  heif_context_set_max_decoding_threads(file.context.get(), 0);  // the caller's own
  heif_error error = heif_context_read_from_memory_without_copy(file.context.get(), bytes.data(),
                                                                bytes.size(), nullptr);
  heif_image_handle* primary = nullptr;
  if (error.code == heif_error_Ok)
    error = heif_context_get_primary_image_handle(file.context.get(), &primary);
  file.primary.reset(primary);
  file.failure = FailureOf(error);
  return file;
}

}  // namespace veduta
