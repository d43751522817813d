// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a program and its decoder process (process/decoder_process.h) say to each other. The program
// sends a request with two descriptors, of the photo's bytes and of memory for the answer; the
// process has a child decode, which fills that memory and ends; the process tells how the child
// ended. Both are of one build, so these are the compiler's own layouts.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "engine/camera/decoder.h"

namespace veduta {

// Raise it whenever anything here changes.
inline constexpr uint32_t kExchangeVersion = 3;
// The descriptor at which a decoder process finds its program.
inline constexpr int kControlDescriptor = 3;

// Text of at most kSize bytes.
template <size_t kSize>
struct ExchangedText {
  uint32_t size = 0;
  std::array<char, kSize> bytes = {};
};

// The first message of a decoder process.
struct DecoderGreeting {
  uint32_t version = kExchangeVersion;
  uint32_t is_ready = 0;  // 1: its children are shut in; otherwise why_not says why they are not
  ExchangedText<240> why_not;
};

enum class DecodeTask : uint32_t { kExamine = 1, kDecodePixels = 2 };

struct DecoderRequest {
  DecodeTask task = DecodeTask::kExamine;
  uint32_t width_px = 0, height_px = 0;  // of the pixels wanted; kDecodePixels
  uint32_t cpu_s = 0, wall_s = 0;        // what decoding may take
  uint64_t photo_bytes = 0, answer_bytes = 0;
  uint64_t memory_bytes = 0;  // that decoding may take besides
};

// How a child ended.
struct DecoderEnd {
  int32_t wait_status = 0;                  // as waitpid has it
  uint32_t is_started = 0, is_overdue = 0;  // overdue: it was ended for taking longer than wall_s
};

// The start of the memory for the answer. Pixels follow at kPixelsOffset, row by row without gaps.
struct DecoderAnswer {
  uint32_t outcome = 0;  // HeaderOutcome or PixelOutcome, by the task
  ExchangedText<512> detail;
  // The rest is of kExamine.
  uint32_t format = 0, width_px = 0, height_px = 0, orientation = 0, has_restarts = 0;
  uint32_t sensor_orientation = 0;
  ExchangedText<64> make, model, lens;
  double focal_mm = 0, digital_zoom = 0, focal_35mm = 0;
  uint32_t taken_width_px = 0, taken_height_px = 0;
  uint32_t has_gps = 0, has_height = 0, has_heading = 0;
  double latitude_deg = 0, longitude_deg = 0, height_m = 0, accuracy_m = 0, heading_deg = 0;
  uint32_t has_taken = 0, has_taken_offset = 0;
  int64_t taken_local_unix_s = 0;
  int32_t taken_offset_s = 0;
};
inline constexpr uint64_t kPixelsOffset = 4096;
static_assert(sizeof(DecoderAnswer) <= kPixelsOffset);

// The text, cut where there is no room for it; bytes that are not printable ASCII become '?'.
template <size_t kSize>
ExchangedText<kSize> ToExchange(std::string_view text) {
  ExchangedText<kSize> sent;
  for (const char c : text.substr(0, kSize)) sent.bytes[sent.size++] = c < ' ' || c > '~' ? '?' : c;
  return sent;
}
// Nothing where it is longer than it can be, or has other bytes than printable ASCII.
template <size_t kSize>
std::optional<std::string> FromExchange(const ExchangedText<kSize>& sent) {
  if (sent.size > kSize) return std::nullopt;
  std::string text(sent.bytes.data(), sent.size);
  for (const char c : text) {
    if (c < ' ' || c > '~') return std::nullopt;
  }
  return text;
}

DecoderAnswer AnswerOf(const PhotoExamination& found);
DecoderAnswer AnswerOf(const Pixels& pixels);  // without the pixels themselves

// Nothing where the answer is none that the functions above make of what an honest decoder finds:
// whoever gave it may have been taken over by the photo.
std::optional<PhotoExamination> ReadExamination(const DecoderAnswer& answer);
std::optional<Pixels> ReadPixelOutcome(const DecoderAnswer& answer);

}  // namespace veduta
