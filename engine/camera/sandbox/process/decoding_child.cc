// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/sandbox/process/decoding_child.h"

#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>

#include "engine/camera/sandbox/shared_memory.h"

namespace veduta {
namespace {

constexpr int kAnswered = 0, kNotBegun = 1;

DecoderAnswer Examine(std::span<const uint8_t> photo) {
  try {
    return AnswerOf(DecoderInProcess().Examine(photo));
  } catch (const std::exception&) {
    PhotoExamination failed;
    failed.header.outcome = HeaderOutcome::kNoMemory;
    return AnswerOf(failed);
  }
}

// Writes the rows where they belong in `memory`, if there are any.
DecoderAnswer DecodeInto(std::span<const uint8_t> photo, const DecoderRequest& request,
                         const MappedMemory& memory) {
  Pixels pixels{PixelOutcome::kUnreadable, "the photo's header is read in two ways", {}};
  try {
    const PhotoHeader header = ReadPhotoHeader(photo);
    const ImageSize wanted{request.width_px, request.height_px};
    if (header.stored_size == wanted) pixels = DecodePixels(photo, header);
    if (pixels.outcome != PixelOutcome::kDecoded) return AnswerOf(pixels);
    const size_t row_bytes = size_t{3} * wanted.width_px;
    if (kPixelsOffset + row_bytes * wanted.height_px != memory.size_bytes()) _exit(kNotBegun);
    for (int row = 0; row < pixels.bgr.rows; ++row)
      std::memcpy(memory.data() + kPixelsOffset + row_bytes * static_cast<size_t>(row),
                  pixels.bgr.ptr(row), row_bytes);
  } catch (const std::exception&) {
    pixels.outcome = PixelOutcome::kNoMemory;
  }
  return AnswerOf(pixels);
}

}  // namespace

void PrepareToDecode() {
  cv::setNumThreads(1);  // others could not be started
  // exiv2 asks where its program lies before the first error that it tells.
  ReadExifCamera(std::array<uint8_t, 8>{});
  // libtiff sorts, and the C library asks the system how much memory there is when it sorts more
  // than 1 KiB for the first time.
  std::array<int, 512> sorted = {};
  std::qsort(sorted.data(), sorted.size(), sizeof(int), [](const void*, const void*) { return 0; });
}

void DecodeShutIn(const Lockdown& lockdown, const DecoderRequest& request, int photo, int answer) {
  using Access = MappedMemory::Access;
  const auto bytes = MappedMemory::Map(photo, request.photo_bytes, Access::kRead);
  const auto memory = MappedMemory::Map(answer, request.answer_bytes, Access::kWrite);
  if (!bytes.ok() || !memory.ok() || memory->size_bytes() < kPixelsOffset) _exit(kNotBegun);
  if (!lockdown.Enter({request.memory_bytes, request.cpu_s}).ok()) _exit(kNotBegun);
  const std::span<const uint8_t> seen(bytes->data(), bytes->size_bytes());
  const DecoderAnswer made =
      request.task == DecodeTask::kExamine ? Examine(seen) : DecodeInto(seen, request, *memory);
  std::memcpy(memory->data(), &made, sizeof(made));
  _exit(kAnswered);
}

}  // namespace veduta
