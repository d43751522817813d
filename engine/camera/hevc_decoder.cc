// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/hevc_decoder.h"

#include <libde265/de265.h>
#include <libheif/heif.h>
#include <libheif/heif_plugin.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <mutex>
#include <new>
#include <vector>

#include "engine/camera/hevc_stream.h"
#include "storage/base/status.h"

namespace veduta {
namespace {

constexpr int kPriority = 1000;  // libheif's own has 100
// As DecodeLimits::pixels_max.
constexpr uint64_t kPixelsMax = 200'000'000;
// libheif's callbacks cannot say which file they decode. It calls them on the caller's thread.
thread_local uint64_t thread_pixels_max = kPixelsMax;

constexpr heif_error kOk = {heif_error_Ok, heif_suberror_Unspecified, "Success"};
constexpr heif_error kNoMemory = {heif_error_Memory_allocation_error, heif_suberror_Unspecified,
                                  "no memory for the picture"};

heif_error Damaged(const char* message) {
  return {heif_error_Decoder_plugin_error, heif_suberror_Unspecified, message};
}

heif_error ErrorOf(HevcStreamOutcome outcome) {
  switch (outcome) {
    case HevcStreamOutcome::kTaken:
      return kOk;
    case HevcStreamOutcome::kCutShort:
      return Damaged("its HEVC is cut short");
    case HevcStreamOutcome::kNoStillPicture:
      return Damaged("its HEVC is not one still picture");
    case HevcStreamOutcome::kTooLarge:
      break;
  }
  return Damaged("its HEVC claims more pixels than the file does");
}

// What an error or a warning of libde265 means. None comes from a sound picture.
heif_error ErrorOf(de265_error error) {
  switch (error) {
    case DE265_OK:
      return kOk;
    case DE265_ERROR_OUT_OF_MEMORY:
    case DE265_WARNING_CANNOT_APPLY_SAO_OUT_OF_MEMORY:
      return kNoMemory;
    default:
      return Damaged(de265_get_error_text(error));
  }
}

// What the planes of a picture hold before it is decoded.
// ------------------------------------------------------------------------------------------------

constexpr int kBlockSide = 4;  // samples; the smallest block that HEVC decodes
constexpr size_t kAlignment = 16, kPadding = 64;
static_assert(__STDCPP_DEFAULT_NEW_ALIGNMENT__ >= kAlignment, "libde265 uses SSE on its planes");

struct Plane {
  int width = 0, height = 0, bit_depth = 0;
  size_t stride_bytes = 0;
  std::vector<uint8_t> bytes;

  size_t BytesPerSample() const { return bit_depth > 8 ? 2 : 1; }
};

// The four bytes of the pattern at a place. Samples stay within their bits, as libde265 expects of
// them. The factors are those of xxHash32 (its specification, section "XXH32 algorithm").
uint32_t PatternWord(size_t row, size_t word, int bit_depth) {
  uint32_t hash =
      static_cast<uint32_t>(row) * 2654435761u ^ static_cast<uint32_t>(word) * 3266489917u;
  hash = (hash ^ hash >> 15) * 2246822519u;
  hash ^= hash >> 13;
  return bit_depth > 8 ? hash & ((1u << bit_depth) - 1) * 0x10001u : hash;
}

void FillWithPattern(Plane* plane) {
  for (int row = 0; row < plane->height; ++row) {
    for (size_t word = 0; word < plane->stride_bytes / 4; ++word) {
      const uint32_t value = PatternWord(row, word, plane->bit_depth);
      std::memcpy(&plane->bytes[row * plane->stride_bytes + 4 * word], &value, 4);
    }
  }
}

bool IsPattern(const Plane& plane, int first_row, size_t first_word, size_t word_count) {
  for (int row = first_row; row < first_row + kBlockSide; ++row) {
    for (size_t word = first_word; word < first_word + word_count; ++word) {
      uint32_t value = 0;
      std::memcpy(&value, &plane.bytes[row * plane.stride_bytes + 4 * word], 4);
      if (value != PatternWord(row, word, plane.bit_depth)) return false;
    }
  }
  return true;
}

// HEVC's pictures have whole blocks only; what the file crops away is decoded, too.
bool HasHole(const Plane& plane) {
  const size_t word_count = plane.BytesPerSample();  // of a row of a block
  for (int row = 0; row + kBlockSide <= plane.height; row += kBlockSide) {
    for (int column = 0; column + kBlockSide <= plane.width; column += kBlockSide) {
      if (IsPattern(plane, row, column / kBlockSide * word_count, word_count)) return true;
    }
  }
  return false;
}

// The planes of the one picture that is tried. They outlive libde265's use of them.
struct Trial {
  uint64_t pixels_max = 0;
  bool is_refused = false;
  std::array<Plane, 3> planes;

  bool Allocate(const de265_image_spec& spec, de265_image* image) {
    is_refused =
        !planes[0].bytes.empty() ||  // a second picture
        static_cast<uint64_t>(spec.width) * static_cast<uint64_t>(spec.height) > pixels_max;
    if (is_refused) return false;
    const int plane_count = spec.format == de265_image_format_mono8 ? 1 : 3;
    const bool is_narrow =
        spec.format == de265_image_format_YUV420P8 || spec.format == de265_image_format_YUV422P8;
    const bool is_low = spec.format == de265_image_format_YUV420P8;
    for (int c = 0; c < plane_count; ++c) {
      Plane& plane = planes[c];
      plane.width = c > 0 && is_narrow ? spec.width / 2 : spec.width;
      plane.height = c > 0 && is_low ? spec.height / 2 : spec.height;
      plane.bit_depth = de265_get_bits_per_pixel(image, c);
      const size_t aligned_width = (plane.width + kAlignment - 1) / kAlignment * kAlignment;
      plane.stride_bytes = aligned_width * plane.BytesPerSample();
      plane.bytes.resize(plane.stride_bytes * plane.height + kPadding);
      FillWithPattern(&plane);
    }
    for (int c = 0; c < 3; ++c) {
      de265_set_image_plane(image, c, c < plane_count ? planes[c].bytes.data() : nullptr,
                            static_cast<int>(planes[c].stride_bytes), nullptr);
    }
    return true;
  }
};

int AllocateForTrial(de265_decoder_context*, de265_image_spec* spec, de265_image* image,
                     void* trial) {
  try {
    return static_cast<Trial*>(trial)->Allocate(*spec, image) ? 1 : 0;
  } catch (const std::bad_alloc&) {
    return 0;
  }
}

// Decoding.
// ------------------------------------------------------------------------------------------------

struct ContextDeleter {
  void operator()(de265_decoder_context* context) const { de265_free_decoder(context); }
};
struct ImageDeleter {
  void operator()(heif_image* image) const { heif_image_release(image); }
};
struct ProfileDeleter {
  void operator()(heif_color_profile_nclx* profile) const { heif_nclx_color_profile_free(profile); }
};
using Context = std::unique_ptr<de265_decoder_context, ContextDeleter>;
using Image = std::unique_ptr<heif_image, ImageDeleter>;

// Null where there is no memory. Without worker threads: those of a picture end in another order.
Context NewContext() {
  Context context(de265_new_decoder());
  if (context)
    de265_set_parameter_bool(context.get(), DE265_DECODER_PARAM_SUPPRESS_FAULTY_PICTURES, 1);
  return context;
}

// Sets *picture where nothing was wrong. It is the context's.
heif_error DecodePicture(const HevcStream& stream, de265_decoder_context* context,
                         const de265_image** picture) {
  for (const std::vector<uint8_t>& unit : stream.units()) {
    const de265_error error =
        de265_push_NAL(context, unit.data(), static_cast<int>(unit.size()), 0, nullptr);
    if (error != DE265_OK) return ErrorOf(error);
  }
  de265_flush_data(context);
  *picture = nullptr;
  int has_more = 1;
  while (has_more != 0 && de265_peek_next_picture(context) == nullptr) {
    has_more = 0;
    const de265_error error = de265_decode(context, &has_more);
    if (error != DE265_OK) return ErrorOf(error);
  }
  const de265_error warning = de265_get_warning(context);
  if (warning != DE265_OK) return ErrorOf(warning);
  *picture = de265_get_next_picture(context);
  return *picture != nullptr ? kOk : Damaged("its HEVC has no whole picture");
}

// Whether every sample of the picture comes from the stream.
heif_error TryPicture(const HevcStream& stream, uint64_t pixels_max) {
  Trial trial;
  trial.pixels_max = pixels_max;
  de265_image_allocation allocation = {AllocateForTrial,
                                       [](de265_decoder_context*, de265_image*, void*) {}};
  const Context context = NewContext();
  if (!context) return kNoMemory;
  // Neither changes which samples are decoded; and with SAO, libde265 allocates by itself.
  de265_set_parameter_bool(context.get(), DE265_DECODER_PARAM_DISABLE_DEBLOCKING, 1);
  de265_set_parameter_bool(context.get(), DE265_DECODER_PARAM_DISABLE_SAO, 1);
  de265_set_image_allocation_functions(context.get(), &allocation, &trial);
  const de265_image* picture = nullptr;
  const heif_error error = DecodePicture(stream, context.get(), &picture);
  if (trial.is_refused) return ErrorOf(HevcStreamOutcome::kTooLarge);
  if (error.code != heif_error_Ok) return error;
  return std::any_of(trial.planes.begin(), trial.planes.end(), HasHole)
             ? Damaged("its HEVC lacks a part of the picture")
             : kOk;
}

heif_error CopyPlane(const de265_image* picture, int c, heif_image* image) {
  constexpr std::array kChannels = {heif_channel_Y, heif_channel_Cb, heif_channel_Cr};
  const int width = de265_get_image_width(picture, c), height = de265_get_image_height(picture, c);
  const int bit_depth = de265_get_bits_per_pixel(picture, c);
  if (width <= 0 || height <= 0) return Damaged("its HEVC declares no pixels");
  if (bit_depth != de265_get_bits_per_pixel(picture, 0)) {
    return {heif_error_Unsupported_feature, heif_suberror_Unsupported_bit_depth,
            "its channels have unequal bits"};
  }
  const heif_error error = heif_image_add_plane(image, kChannels[c], width, height, bit_depth);
  if (error.code != heif_error_Ok) return error;
  int from_stride = 0, to_stride = 0;
  const uint8_t* const from = de265_get_image_plane(picture, c, &from_stride);
  uint8_t* const to = heif_image_get_plane(image, kChannels[c], &to_stride);
  for (int row = 0; row < height; ++row) {
    std::memcpy(to + static_cast<ptrdiff_t>(row) * to_stride,
                from + static_cast<ptrdiff_t>(row) * from_stride,
                static_cast<size_t>(width) * (bit_depth > 8 ? 2 : 1));
  }
  return kOk;
}

// What the stream says of its colours. What the file's own boxes say goes before it.
heif_error CopyColours(const de265_image* picture, heif_image* image) {
  const std::unique_ptr<heif_color_profile_nclx, ProfileDeleter> profile(
      heif_nclx_color_profile_alloc());
  if (!profile) return kNoMemory;
  const auto number = [](int value) { return static_cast<uint16_t>(value); };
  for (const heif_error& error :
       {heif_nclx_color_profile_set_color_primaries(
            profile.get(), number(de265_get_image_colour_primaries(picture))),
        heif_nclx_color_profile_set_transfer_characteristics(
            profile.get(), number(de265_get_image_transfer_characteristics(picture))),
        heif_nclx_color_profile_set_matrix_coefficients(
            profile.get(), number(de265_get_image_matrix_coefficients(picture)))}) {
    if (error.code != heif_error_Ok) return error;
  }
  profile->full_range_flag = de265_get_image_full_range_flag(picture) != 0;
  return heif_image_set_nclx_color_profile(image, profile.get());
}

heif_error Convert(const de265_image* picture, Image* converted) {
  const de265_chroma chroma = de265_get_chroma_format(picture);
  const bool is_gray = chroma == de265_chroma_mono;
  heif_image* image = nullptr;
  heif_error error =
      heif_image_create(de265_get_image_width(picture, 0), de265_get_image_height(picture, 0),
                        is_gray ? heif_colorspace_monochrome : heif_colorspace_YCbCr,
                        static_cast<heif_chroma>(chroma), &image);
  converted->reset(image);
  for (int c = 0; c < (is_gray ? 1 : 3) && error.code == heif_error_Ok; ++c)
    error = CopyPlane(picture, c, image);
  return error.code == heif_error_Ok ? CopyColours(picture, image) : error;
}

heif_error Decode(const HevcStream& stream, uint64_t pixels_max, Image* image) {
  if (stream.picture_count() != 1) return ErrorOf(HevcStreamOutcome::kNoStillPicture);
  const heif_error tried = TryPicture(stream, pixels_max);
  if (tried.code != heif_error_Ok) return tried;
  const Context context = NewContext();
  if (!context) return kNoMemory;
  const de265_image* picture = nullptr;
  const heif_error error = DecodePicture(stream, context.get(), &picture);
  return error.code == heif_error_Ok ? Convert(picture, image) : error;
}

// What libheif calls: C, which no exception may enter.
// ------------------------------------------------------------------------------------------------

struct Decoder {
  uint64_t pixels_max = thread_pixels_max;
  HevcStream stream{thread_pixels_max};
};

heif_error NewDecoder(void** decoder) {
  *decoder = new (std::nothrow) Decoder;
  return *decoder != nullptr ? kOk : kNoMemory;
}

heif_error PushData(void* decoder, const void* data, size_t size) {
  try {
    return ErrorOf(
        static_cast<Decoder*>(decoder)->stream.Push({static_cast<const uint8_t*>(data), size}));
  } catch (const std::exception&) {
    return kNoMemory;
  }
}

heif_error DecodeImage(void* decoder, heif_image** image) {
  *image = nullptr;
  try {
    const auto& from = *static_cast<const Decoder*>(decoder);
    Image decoded;
    const heif_error error = Decode(from.stream, from.pixels_max, &decoded);
    if (error.code == heif_error_Ok) *image = decoded.release();
    return error;
  } catch (const std::exception&) {
    return kNoMemory;
  }
}

constexpr heif_decoder_plugin kHevcPlugin = {
    3,  // of libheif 1.15
    [] { return "Veduta's HEVC decoder"; },
    nullptr,
    nullptr,
    [](heif_compression_format format) { return format == heif_compression_HEVC ? kPriority : 0; },
    NewDecoder,
    [](void* decoder) { delete static_cast<Decoder*>(decoder); },
    PushData,
    DecodeImage,
    [](void*, int) {},  // it is always strict
    "veduta-hevc",
};

heif_error RefuseAv1(void** decoder) {
  *decoder = nullptr;
  return {heif_error_Unsupported_feature, heif_suberror_Unsupported_codec,
          "it has AV1, as an AVIF"};
}

constexpr heif_decoder_plugin kAv1Plugin = {
    3,
    [] { return "Veduta's refusal of AV1"; },
    nullptr,
    nullptr,
    [](heif_compression_format format) { return format == heif_compression_AV1 ? kPriority : 0; },
    RefuseAv1,
    [](void*) {},
    nullptr,  // never called: there is no decoder
    nullptr,
    [](void*, int) {},
    "veduta-no-av1",
};

}  // namespace

void RegisterHevcDecoder() {
  static std::once_flag is_registered;
  std::call_once(is_registered, [] {
    for (const heif_decoder_plugin* plugin : {&kHevcPlugin, &kAv1Plugin}) {
      VEDUTA_CHECK(heif_register_decoder_plugin(plugin).code == heif_error_Ok,
                   "libheif knows this version of its plugins");
    }
  });
}

HevcPixelLimit::HevcPixelLimit(uint64_t pixels_max) : outer_pixels_max_(thread_pixels_max) {
  thread_pixels_max = pixels_max;
}

HevcPixelLimit::~HevcPixelLimit() {
  thread_pixels_max = outer_pixels_max_;
}

}  // namespace veduta
