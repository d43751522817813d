// SPDX-License-Identifier: Apache-2.0
#pragma once
// Family `dense`: the small records of the dense pass, four kinds of entry. The first three also
// name the pixels in `depth`.

#include <cstdint>
#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/records/key_bytes.h"

namespace veduta {

// First byte of a key in `dense` and, for 2 and 3, in `depth`. Never renumbered.
enum class DenseEntry : uint8_t {
  kSettings = 1,      // reconstruction
  kDepth = 2,         // image
  kCheckedDepth = 3,  // image, version
  kTile = 4,          // reconstruction, place
};

// The entry, then an id: a key, or a prefix of keys.
std::string DenseKey(DenseEntry entry, uint32_t id);
// What follows the first byte of a key begins with this id, which is taken off; false when it is
// too short or the id is 0.
template <typename Id>
bool TakeId(std::string_view* key, Id* id) {
  return TakeBigEndian32(key, &id->value) && id->valid();
}
Status WrongDenseKey();

}  // namespace veduta
