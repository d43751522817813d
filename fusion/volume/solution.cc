// SPDX-License-Identifier: Apache-2.0
#include "fusion/volume/solution.h"

#include <algorithm>

namespace veduta {
namespace {

constexpr uint8_t kVersion = 1;
constexpr size_t kValuesAt = 1, kSupportAt = kValuesAt + 2 * static_cast<size_t>(kBlockVoxels);
constexpr size_t kDualAt = kSupportAt + kBlockVoxels,
                 kSolutionBytes = kDualAt + 3 * static_cast<size_t>(kBlockVoxels);

}  // namespace

uint8_t SupportOf(const HistogramBlock& block, size_t voxel) {
  const uint32_t maps = block.near_maps[voxel];
  if (maps > 0) return static_cast<uint8_t>(std::min(maps + 1, 255u));
  return block.counts[kNearBins][voxel] > 0 ? 1 : 0;
}

std::vector<uint8_t> Serialize(const SolutionBlock& block) {
  std::vector<uint8_t> bytes(kSolutionBytes);
  bytes[0] = kVersion;
  for (size_t i = 0; i < kBlockVoxels; ++i) {
    const auto value = static_cast<uint16_t>(block.value[i]);
    bytes[kValuesAt + 2 * i] = static_cast<uint8_t>(value & 255);
    bytes[kValuesAt + 2 * i + 1] = static_cast<uint8_t>(value >> 8);
  }
  std::copy(block.support.begin(), block.support.end(), bytes.begin() + kSupportAt);
  for (size_t axis = 0; axis < 3; ++axis) {
    for (size_t i = 0; i < kBlockVoxels; ++i) {
      bytes[kDualAt + axis * kBlockVoxels + i] = static_cast<uint8_t>(block.dual[axis][i]);
    }
  }
  return bytes;
}

Result<std::unique_ptr<SolutionBlock>> ParseSolutionBlock(std::span<const uint8_t> bytes) {
  if (bytes.size() != kSolutionBytes) {
    return Status::Corruption("a solution block has " + std::to_string(bytes.size()) +
                              " bytes, not " + std::to_string(kSolutionBytes));
  }
  if (bytes[0] != kVersion)
    return Status::Corruption("a solution block of version " + std::to_string(bytes[0]));
  auto block = std::make_unique<SolutionBlock>();
  for (size_t i = 0; i < kBlockVoxels; ++i) {
    const auto low = bytes[kValuesAt + 2 * i], high = bytes[kValuesAt + 2 * i + 1];
    block->value[i] = static_cast<int16_t>(static_cast<uint16_t>(low | high << 8));
    if (block->value[i] < -kSolutionOne)
      return Status::Corruption("a solution block has a value below -1");
  }
  std::copy_n(bytes.begin() + kSupportAt, kBlockVoxels, block->support.begin());
  for (size_t axis = 0; axis < 3; ++axis) {
    for (size_t i = 0; i < kBlockVoxels; ++i) {
      block->dual[axis][i] = static_cast<int8_t>(bytes[kDualAt + axis * kBlockVoxels + i]);
      if (block->dual[axis][i] < -kDualOne)
        return Status::Corruption("a solution block has a dual variable below -1");
    }
  }
  return block;
}

}  // namespace veduta
