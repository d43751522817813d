// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/sandbox/exchange.h"

namespace veduta {
namespace {

// As ReadExifCamera and ReadExifGps have it (engine/camera/exif.cc).
constexpr double kNumberMax = 10'000;

// False for what is no number as well.
bool IsWithin(double number, double least, double most) {
  return number >= least && number <= most;
}

bool IsFlag(uint32_t flag) {
  return flag <= 1;
}

bool IsSound(const PhotoHeader& header) {
  if (header.outcome != HeaderOutcome::kRead) return true;
  return header.detail.empty() && !header.stored_size.empty() &&
         header.format != PhotoFormat::kUnknown;
}

std::optional<PhotoHeader> ReadHeader(const DecoderAnswer& answer) {
  const std::optional<std::string> detail = FromExchange(answer.detail);
  if (!detail || answer.outcome > static_cast<uint32_t>(HeaderOutcome::kNoMemory) ||
      answer.format > static_cast<uint32_t>(PhotoFormat::kHeif) || answer.orientation < 1 ||
      answer.orientation > 8 || answer.sensor_orientation < 1 || answer.sensor_orientation > 8 ||
      !IsFlag(answer.has_restarts)) {
    return std::nullopt;
  }
  PhotoHeader header;
  header.outcome = static_cast<HeaderOutcome>(answer.outcome);
  header.detail = *detail;
  header.format = static_cast<PhotoFormat>(answer.format);
  header.stored_size = {answer.width_px, answer.height_px};
  header.orientation = static_cast<int>(answer.orientation);
  header.sensor_orientation = static_cast<int>(answer.sensor_orientation);
  header.has_restarts = answer.has_restarts == 1;
  if (!IsSound(header)) return std::nullopt;
  return header;
}

std::optional<ExifCamera> ReadCamera(const DecoderAnswer& answer) {
  const auto make = FromExchange(answer.make), model = FromExchange(answer.model),
             lens = FromExchange(answer.lens);
  if (!make || !model || !lens || !IsWithin(answer.focal_mm, 0, kNumberMax) ||
      !IsWithin(answer.digital_zoom, 0, kNumberMax) ||
      !IsWithin(answer.focal_35mm, 0, kNumberMax)) {
    return std::nullopt;
  }
  return ExifCamera{*make,
                    *model,
                    *lens,
                    answer.focal_mm,
                    answer.digital_zoom,
                    answer.focal_35mm,
                    answer.taken_width_px,
                    answer.taken_height_px};
}

// Whether there is a sound one, or none.
bool ReadGps(const DecoderAnswer& answer, std::optional<GpsFix>* gps) {
  if (!IsFlag(answer.has_gps) || !IsFlag(answer.has_height) || !IsFlag(answer.has_heading))
    return false;
  if (answer.has_gps == 0) return true;
  if (!IsWithin(answer.latitude_deg, -90, 90) || !IsWithin(answer.longitude_deg, -180, 180) ||
      !IsWithin(answer.accuracy_m, 0, kNumberMax) ||
      !IsWithin(answer.height_m, -kNumberMax, kNumberMax) ||
      !(answer.heading_deg >= 0 && answer.heading_deg < 360)) {
    return false;
  }
  GpsFix& fix = gps->emplace();
  fix.latitude_deg = answer.latitude_deg;
  fix.longitude_deg = answer.longitude_deg;
  fix.accuracy_m = answer.accuracy_m;
  if (answer.has_height == 1) fix.height_m = answer.height_m;
  if (answer.has_heading == 1) fix.heading_deg = answer.heading_deg;
  return true;
}

bool ReadTaken(const DecoderAnswer& answer, std::optional<TakenTime>* taken) {
  if (!IsFlag(answer.has_taken) || !IsFlag(answer.has_taken_offset)) return false;
  if (answer.has_taken == 0) return true;
  if (answer.taken_local_unix_s < kTakenUnixSMin || answer.taken_local_unix_s > kTakenUnixSMax ||
      answer.taken_offset_s < kTakenOffsetSMin || answer.taken_offset_s > kTakenOffsetSMax) {
    return false;
  }
  *taken = TakenTime{answer.taken_local_unix_s, std::nullopt};
  if (answer.has_taken_offset == 1) (*taken)->offset_s = answer.taken_offset_s;
  return true;
}

}  // namespace

DecoderAnswer AnswerOf(const PhotoExamination& found) {
  DecoderAnswer answer;
  answer.outcome = static_cast<uint32_t>(found.header.outcome);
  answer.detail = ToExchange<512>(found.header.detail);
  answer.format = static_cast<uint32_t>(found.header.format);
  answer.width_px = found.header.stored_size.width_px;
  answer.height_px = found.header.stored_size.height_px;
  answer.orientation = static_cast<uint32_t>(found.header.orientation);
  answer.sensor_orientation = static_cast<uint32_t>(found.header.sensor_orientation);
  answer.has_restarts = found.header.has_restarts ? 1 : 0;
  answer.make = ToExchange<64>(found.camera.make);
  answer.model = ToExchange<64>(found.camera.model);
  answer.lens = ToExchange<64>(found.camera.lens);
  answer.focal_mm = found.camera.focal_mm;
  answer.digital_zoom = found.camera.digital_zoom;
  answer.focal_35mm = found.camera.focal_35mm;
  answer.taken_width_px = found.camera.taken_width_px;
  answer.taken_height_px = found.camera.taken_height_px;
  if (found.taken) {
    answer.has_taken = 1;
    answer.taken_local_unix_s = found.taken->local_unix_s;
    answer.has_taken_offset = found.taken->offset_s ? 1 : 0;
    answer.taken_offset_s = found.taken->offset_s.value_or(0);
  }
  if (!found.gps) return answer;
  answer.has_gps = 1;
  answer.latitude_deg = found.gps->latitude_deg;
  answer.longitude_deg = found.gps->longitude_deg;
  answer.accuracy_m = found.gps->accuracy_m;
  answer.has_height = found.gps->height_m ? 1 : 0;
  answer.height_m = found.gps->height_m.value_or(0);
  answer.has_heading = found.gps->heading_deg ? 1 : 0;
  answer.heading_deg = found.gps->heading_deg.value_or(0);
  return answer;
}

DecoderAnswer AnswerOf(const Pixels& pixels) {
  DecoderAnswer answer;
  answer.outcome = static_cast<uint32_t>(pixels.outcome);
  answer.detail = ToExchange<512>(pixels.detail);
  return answer;
}

std::optional<PhotoExamination> ReadExamination(const DecoderAnswer& answer) {
  PhotoExamination found;
  const std::optional<PhotoHeader> header = ReadHeader(answer);
  const std::optional<ExifCamera> camera = ReadCamera(answer);
  if (!header || !camera || !ReadGps(answer, &found.gps) || !ReadTaken(answer, &found.taken)) {
    return std::nullopt;
  }
  found.header = *header;
  found.camera = *camera;
  return found;
}

std::optional<Pixels> ReadPixelOutcome(const DecoderAnswer& answer) {
  const std::optional<std::string> detail = FromExchange(answer.detail);
  if (!detail || answer.outcome > static_cast<uint32_t>(PixelOutcome::kNoMemory))
    return std::nullopt;
  return Pixels{static_cast<PixelOutcome>(answer.outcome), *detail, {}};
}

}  // namespace veduta
