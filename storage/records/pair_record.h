// SPDX-License-Identifier: Apache-2.0
#pragma once
// Family `pairs`: two kinds of entry. FORMAT.md, section "pair_record".

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/pair.h"

namespace veduta {

// First byte of the key. Never renumbered.
enum class PairEntry : uint8_t {
  kNeighbor = 1,  // image, other: under both orders, a few bytes
  kRecord = 2,    // smaller, larger: everything, with the matches
};

std::string NeighborPrefix(ImageId image);
std::string NeighborKey(ImageId image, ImageId other);
std::string PairKey(ImageId smaller, ImageId larger);

Status Check(const PairRecord& pair);
Result<std::string> Encode(const PairRecord& pair);
Status Decode(std::string_view value, ImageId a, ImageId b, PairRecord* pair);

Status Check(const PairNeighbor& neighbor);
Result<std::string> Encode(const PairNeighbor& neighbor);
Status Decode(std::string_view value, ImageId image, PairNeighbor* neighbor);

}  // namespace veduta
