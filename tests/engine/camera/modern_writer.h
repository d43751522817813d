// SPDX-License-Identifier: Apache-2.0
#pragma once
// Writes the WebP and HEIF files that the decoder's tests read.

#include <libheif/heif.h>
#include <webp/encode.h>
#include <webp/mux.h>

#include <opencv2/core.hpp>
#include <vector>

#include "tests/engine/camera/photo_writer.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__clang__)
// x265 keeps some kilobytes of each encoding.
extern "C" __attribute__((used, weak)) const char* __lsan_default_suppressions() {
  return "leak:x265_malloc\n";
}
#endif

namespace veduta::testing {

inline FileBytes WebpFile(const cv::Mat& bgr, bool is_lossless = false, FileBytes exif = {}) {
  uint8_t* data = nullptr;
  const int stride = static_cast<int>(bgr.step[0]);
  const size_t size = is_lossless
                          ? WebPEncodeLosslessBGR(bgr.data, bgr.cols, bgr.rows, stride, &data)
                          : WebPEncodeBGR(bgr.data, bgr.cols, bgr.rows, stride, 95, &data);
  FileBytes bytes(data, data + size);
  WebPFree(data);
  if (exif.empty()) return bytes;
  WebPMux* const mux = WebPMuxNew();
  const WebPData picture{bytes.data(), bytes.size()}, block{exif.data(), exif.size()};
  WebPMuxSetImage(mux, &picture, 1);
  WebPMuxSetChunk(mux, "EXIF", &block, 1);
  WebPData whole;
  WebPMuxAssemble(mux, &whole);
  FileBytes with_exif(whole.bytes, whole.bytes + whole.size);
  WebPDataClear(&whole);
  WebPMuxDelete(mux);
  return with_exif;
}

struct HeifKind {
  heif_compression_format compression = heif_compression_HEVC;
  heif_orientation orientation = heif_orientation_normal;  // what a reader is to do to the pixels
  FileBytes exif = {};                                     // none where empty
};

// Empty where libheif has no encoder of that kind.
inline FileBytes HeifFileOf(const cv::Mat& bgr, const HeifKind& kind = {}) {
  heif_context* const context = heif_context_alloc();
  heif_encoder* encoder = nullptr;
  FileBytes bytes;
  if (heif_context_get_encoder_for_format(context, kind.compression, &encoder).code ==
      heif_error_Ok) {
    heif_encoder_set_lossy_quality(encoder, 95);
    heif_image* image = nullptr;
    heif_image_create(bgr.cols, bgr.rows, heif_colorspace_RGB, heif_chroma_interleaved_RGB, &image);
    heif_image_add_plane(image, heif_channel_interleaved, bgr.cols, bgr.rows, 8);
    int stride = 0;
    uint8_t* const rows = heif_image_get_plane(image, heif_channel_interleaved, &stride);
    for (int v = 0; v < bgr.rows; ++v) {
      for (int u = 0; u < bgr.cols; ++u) {
        const auto& pixel = bgr.at<cv::Vec3b>(v, u);
        for (int c = 0; c < 3; ++c) rows[v * stride + 3 * u + c] = pixel[2 - c];
      }
    }
    heif_encoding_options* const options = heif_encoding_options_alloc();
    options->image_orientation = kind.orientation;
    heif_image_handle* handle = nullptr;
    heif_context_encode_image(context, image, encoder, options, &handle);
    if (!kind.exif.empty())
      heif_context_add_exif_metadata(context, handle, kind.exif.data(),
                                     static_cast<int>(kind.exif.size()));
    heif_writer writer{1, [](heif_context*, const void* data, size_t size, void* to) {
                         const auto* from = static_cast<const uint8_t*>(data);
                         static_cast<FileBytes*>(to)->assign(from, from + size);
                         return heif_error{heif_error_Ok, heif_suberror_Unspecified, ""};
                       }};
    heif_context_write(context, &writer, &bytes);
    heif_image_handle_release(handle);
    heif_encoding_options_free(options);
    heif_image_release(image);
    heif_encoder_release(encoder);
  }
  heif_context_free(context);
  return bytes;
}

}  // namespace veduta::testing
