// SPDX-License-Identifier: Apache-2.0
#pragma once
// What keys are made of. Integers are big-endian, so that keys sort as their numbers do and a scan
// over one image, one image's neighbors or one generation is one run of neighboring keys. The keys
// of each record stand with it; their grammar is in storage/FORMAT.md.

#include <cstdint>
#include <string>
#include <string_view>

#include "storage/base/status.h"

namespace veduta {

void AppendBigEndian32(std::string* key, uint32_t value);
void AppendBigEndian64(std::string* key, uint64_t value);
// The number at the front of `key`, which is taken off; false, and nothing taken, when it is too
// short.
bool TakeBigEndian32(std::string_view* key, uint32_t* value);
bool TakeBigEndian64(std::string_view* key, uint64_t* value);

std::string Key32(uint32_t value);
std::string Key32x2(uint32_t first, uint32_t second);
// A key whose first byte says which kind of entry it is.
std::string TaggedKey(uint8_t tag, std::string_view rest);
// A key, or the rest of one, that is one id and nothing else. kCorruption otherwise.
Status ParseId(std::string_view key, uint32_t* id);

// The smallest key that is greater than every key of ours that starts with `prefix`.
std::string PrefixEnd(std::string_view prefix);

// For messages: printable keys as they are, others in hexadecimal.
std::string KeyText(std::string_view key);

}  // namespace veduta
