// SPDX-License-Identifier: Apache-2.0
#include "storage/records/dense_entry.h"

#include "storage/records/key_bytes.h"

namespace veduta {

std::string DenseKey(DenseEntry entry, uint32_t id) {
  return TaggedKey(static_cast<uint8_t>(entry), Key32(id));
}

Status WrongDenseKey() {
  return Status::Corruption("a key of wrong length, or with id 0");
}

}  // namespace veduta
