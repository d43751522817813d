// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/hevc_stream.h"

#include <algorithm>

namespace veduta {
namespace {

// ITU-T H.265, table 7-1.
constexpr int kFirstPictureWithoutOthers = 16, kLastPictureWithoutOthers = 21, kLastSlice = 31;
constexpr int kVideoParameters = 32, kSequenceParameters = 33, kPictureParameters = 34;
constexpr size_t kLengthSize = 4, kUnitHeaderSize = 2;
// The sizes of a picture and of its blocks are the first of a sequence's parameters: 8 layers of 12
// bytes, and 40 numbers, mostly of few bits.
constexpr size_t kPrefixSize = 256;
constexpr uint64_t kSideMax = 65535;  // as libde265 has it

// Reads bits, the highest of each byte first. Past the end there are zeros.
class BitReader {
 public:
  // Leaves out the bytes that keep start codes out of a unit (H.265, 7.3.1.1).
  explicit BitReader(std::span<const uint8_t> escaped) {
    int zero_count = 0;
    for (const uint8_t byte : escaped.first(std::min(escaped.size(), kPrefixSize))) {
      if (zero_count >= 2 && byte == 3) {
        zero_count = 0;
        continue;
      }
      zero_count = byte == 0 ? zero_count + 1 : 0;
      bytes_.push_back(byte);
    }
  }

  bool is_past_end() const { return at_ > 8 * bytes_.size(); }
  void Skip(size_t count) { at_ += count; }
  uint64_t Read(int count) {
    uint64_t value = 0;
    for (int i = 0; i < count; ++i, ++at_) {
      const bool is_inside = at_ / 8 < bytes_.size();
      value = value << 1 | (is_inside ? bytes_[at_ / 8] >> (7 - at_ % 8) & 1 : 0);
    }
    return value;
  }
  // H.265, 9.2.
  uint64_t ReadExpGolomb() {
    int zero_count = 0;
    while (zero_count < 32 && !is_past_end() && Read(1) == 0) ++zero_count;
    return (uint64_t{1} << zero_count) - 1 + Read(zero_count);
  }

 private:
  std::vector<uint8_t> bytes_;
  size_t at_ = 0;
};

// H.265, 7.3.3: 88 bits of a profile and 8 of a level, for the whole and for each layer below it.
void SkipProfiles(int lower_layer_count, BitReader* reader) {
  reader->Skip(88 + 8);
  size_t layers_size = 0;
  for (int i = 0; i < lower_layer_count; ++i) {
    if (reader->Read(1) != 0) layers_size += 88;
    if (reader->Read(1) != 0) layers_size += 8;
  }
  if (lower_layer_count > 0) reader->Skip(2 * static_cast<size_t>(8 - lower_layer_count));
  reader->Skip(layers_size);
}

// Whether the sizes of blocks, which follow those of the pictures, are as H.265, 7.4.3.2.1 wants
// them. libde265 prints it where they are not.
bool HasSoundBlocks(uint64_t width_px, uint64_t height_px, int lower_layer_count,
                    BitReader* reader) {
  const auto skip_numbers = [&](int count) {
    for (int i = 0; i < count; ++i) reader->ReadExpGolomb();
  };
  if (reader->Read(1) != 0) skip_numbers(4);  // what is cropped
  skip_numbers(3);                            // bits of samples and of the order
  const bool is_for_each_layer = reader->Read(1) != 0;
  skip_numbers(3 * (is_for_each_layer ? lower_layer_count + 1 : 1));
  const uint64_t coding_log2_min = 3 + reader->ReadExpGolomb();
  const uint64_t coding_log2_max = coding_log2_min + reader->ReadExpGolomb();
  const uint64_t transform_log2_min = 2 + reader->ReadExpGolomb();
  const uint64_t transform_log2_max = transform_log2_min + reader->ReadExpGolomb();
  const uint64_t inter_depth = reader->ReadExpGolomb(), intra_depth = reader->ReadExpGolomb();
  constexpr uint64_t kCodingLog2Max = 6, kTransformLog2Max = 5;
  if (reader->is_past_end() || coding_log2_max > kCodingLog2Max ||
      transform_log2_min >= coding_log2_min ||
      transform_log2_max > std::min(coding_log2_max, kTransformLog2Max)) {
    return false;
  }
  const uint64_t depth_max = coding_log2_max - transform_log2_min;
  return (width_px | height_px) % (uint64_t{1} << coding_log2_min) == 0 &&
         std::max(inter_depth, intra_depth) <= depth_max;
}

}  // namespace

uint64_t HevcPixelCount(std::span<const uint8_t> unit) {
  if (unit.size() < kUnitHeaderSize) return 0;
  BitReader reader(unit.subspan(kUnitHeaderSize));
  reader.Skip(4);  // the video's parameters
  const auto lower_layer_count = static_cast<int>(reader.Read(3));
  reader.Skip(1);
  SkipProfiles(lower_layer_count, &reader);
  reader.ReadExpGolomb();  // the number of these parameters
  constexpr uint64_t kFullChroma = 3;
  if (reader.ReadExpGolomb() == kFullChroma) reader.Skip(1);
  const uint64_t width_px = reader.ReadExpGolomb(), height_px = reader.ReadExpGolomb();
  if (width_px > kSideMax || height_px > kSideMax) return 0;
  const bool is_sound = HasSoundBlocks(width_px, height_px, lower_layer_count, &reader);
  return is_sound ? width_px * height_px : 0;
}

HevcStreamOutcome HevcStream::PushUnit(std::span<const uint8_t> unit) {
  if (unit.size() < kUnitHeaderSize) return HevcStreamOutcome::kCutShort;
  const int type = unit[0] >> 1 & 0x3F;
  const bool is_of_higher_layer = (unit[0] & 1) != 0 || unit[1] >> 3 != 0;
  const bool is_slice = type <= kLastSlice;
  if (is_of_higher_layer || type > kPictureParameters) return HevcStreamOutcome::kTaken;
  if (is_slice) {
    if (type < kFirstPictureWithoutOthers || type > kLastPictureWithoutOthers)
      return HevcStreamOutcome::kNoStillPicture;
    if (unit.size() == kUnitHeaderSize) return HevcStreamOutcome::kCutShort;
    const bool is_first_of_picture = (unit[kUnitHeaderSize] & 0x80) != 0;
    if (is_first_of_picture && ++picture_count_ > 1) return HevcStreamOutcome::kNoStillPicture;
  } else if (++parameter_unit_count_[type - kVideoParameters] > kHevcParameterUnitsMax) {
    return HevcStreamOutcome::kNoStillPicture;
  }
  if (type == kSequenceParameters) {
    const uint64_t pixel_count = HevcPixelCount(unit);
    if (pixel_count == 0) return HevcStreamOutcome::kCutShort;
    if (pixel_count > pixels_max_) return HevcStreamOutcome::kTooLarge;
  }
  units_.emplace_back(unit.begin(), unit.end());
  return HevcStreamOutcome::kTaken;
}

HevcStreamOutcome HevcStream::Push(std::span<const uint8_t> bytes) {
  while (!bytes.empty()) {
    if (bytes.size() < kLengthSize) return HevcStreamOutcome::kCutShort;
    const size_t size =
        size_t{bytes[0]} << 24 | size_t{bytes[1]} << 16 | size_t{bytes[2]} << 8 | size_t{bytes[3]};
    bytes = bytes.subspan(kLengthSize);
    if (size > bytes.size()) return HevcStreamOutcome::kCutShort;
    const HevcStreamOutcome outcome = PushUnit(bytes.first(size));
    if (outcome != HevcStreamOutcome::kTaken) return outcome;
    bytes = bytes.subspan(size);
  }
  return HevcStreamOutcome::kTaken;
}

}  // namespace veduta
