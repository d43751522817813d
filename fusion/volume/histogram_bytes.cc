// SPDX-License-Identifier: Apache-2.0
#include "fusion/volume/histogram.h"

namespace veduta {
namespace {

constexpr uint8_t kVersion = 1;
constexpr size_t kMasksAt = 1, kCountersAt = kMasksAt + kBlockVoxels;

void AppendVarint(uint32_t value, std::vector<uint8_t>* bytes) {
  for (; value >= 128; value >>= 7) bytes->push_back(static_cast<uint8_t>(value | 128));
  bytes->push_back(static_cast<uint8_t>(value));
}

// Reads counters one after the other; once one is damaged, all are.
class CounterReader {
 public:
  explicit CounterReader(std::span<const uint8_t> bytes) : bytes_(bytes) {}

  uint16_t Next() {
    uint32_t value = 0;
    for (int shift = 0; shift < 21; shift += 7) {
      if (at_ == bytes_.size()) break;
      const uint8_t byte = bytes_[at_++];
      value |= static_cast<uint32_t>(byte & 127) << shift;
      if (byte & 128) continue;
      if (value > 65535 || (byte == 0 && shift > 0))
        break;  // out of range, or not the shortest form
      return static_cast<uint16_t>(value);
    }
    ok_ = false;
    at_ = bytes_.size();
    return 0;
  }
  bool IsAtEnd() const { return ok_ && at_ == bytes_.size(); }
  bool ok() const { return ok_; }

 private:
  std::span<const uint8_t> bytes_;
  size_t at_ = 0;
  bool ok_ = true;
};

// One voxel's counters; whether they are such as votes leave behind.
bool ReadVoxel(uint8_t mask, size_t voxel, CounterReader* reader, HistogramBlock* block) {
  uint32_t near_weight = 0;
  for (int bin = 0; bin < kHistogramBins; ++bin) {
    if (!(mask >> bin & 1)) continue;
    const uint16_t count = reader->Next();
    if (count == 0) return false;
    block->counts[bin][voxel] = count;
    if (bin == kNearBins) continue;
    const uint16_t sum = reader->Next();
    if (sum > uint32_t{count} * (kLevels - 1)) return false;
    block->sums[bin][voxel] = sum;
    near_weight += count;
  }
  if (near_weight == 0) return reader->ok();
  const uint16_t maps = reader->Next();
  block->near_maps[voxel] = maps;
  return reader->ok() && maps > 0 && maps <= near_weight &&
         near_weight <= uint32_t{maps} * kVoteWeightMax;
}

}  // namespace

std::vector<uint8_t> Serialize(const HistogramBlock& block) {
  std::vector<uint8_t> bytes(kCountersAt);
  bytes[0] = kVersion;
  for (size_t voxel = 0; voxel < kBlockVoxels; ++voxel) {
    uint8_t mask = 0;
    for (int bin = 0; bin < kHistogramBins; ++bin) {
      if (block.counts[bin][voxel] == 0) continue;
      mask |= static_cast<uint8_t>(1 << bin);
      AppendVarint(block.counts[bin][voxel], &bytes);
      if (bin < kNearBins) AppendVarint(block.sums[bin][voxel], &bytes);
    }
    if (mask & ((1 << kNearBins) - 1)) AppendVarint(block.near_maps[voxel], &bytes);
    bytes[kMasksAt + voxel] = mask;
  }
  return bytes;
}

Result<std::unique_ptr<HistogramBlock>> ParseHistogramBlock(std::span<const uint8_t> bytes) {
  if (bytes.size() < kCountersAt)
    return Status::Corruption("a histogram block ends within its masks");
  if (bytes[0] != kVersion)
    return Status::Corruption("a histogram block of version " + std::to_string(bytes[0]));
  auto block = std::make_unique<HistogramBlock>();
  CounterReader reader(bytes.subspan(kCountersAt));
  for (size_t voxel = 0; voxel < kBlockVoxels; ++voxel) {
    const uint8_t mask = bytes[kMasksAt + voxel];
    if (mask != 0 && !ReadVoxel(mask, voxel, &reader, block.get())) {
      return Status::Corruption("a histogram block has counters at voxel " + std::to_string(voxel) +
                                " that no votes add up to");
    }
  }
  if (!reader.IsAtEnd())
    return Status::Corruption("a histogram block goes on after its last voxel");
  return block;
}

}  // namespace veduta
