// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which pictures of a HEIF are made of which others.

#include <cstdint>
#include <span>

namespace veduta {

// Whether pictures are made of each other (tiles of a grid, a channel of transparency) in a circle
// or in more than eight steps, or the list of that is not read the same way by everybody. libheif
// 1.15.1 follows it until the stack ends. ISO/IEC 14496-12, 8.11.12. O(n log n) in the references.
bool HasEndlessReferences(std::span<const uint8_t> bytes);

}  // namespace veduta
