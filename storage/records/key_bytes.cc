// SPDX-License-Identifier: Apache-2.0
#include "storage/records/key_bytes.h"

#include <algorithm>

namespace veduta {
namespace {

template <typename Integer>
void AppendBigEndian(std::string* key, Integer value) {
  for (int shift = static_cast<int>(sizeof(Integer)) * 8 - 8; shift >= 0; shift -= 8) {
    key->push_back(static_cast<char>(static_cast<uint8_t>(value >> shift)));
  }
}

template <typename Integer>
bool TakeBigEndian(std::string_view* key, Integer* value) {
  if (key->size() < sizeof(Integer)) return false;
  Integer sum = 0;
  for (size_t i = 0; i < sizeof(Integer); ++i) sum = sum << 8 | static_cast<uint8_t>((*key)[i]);
  key->remove_prefix(sizeof(Integer));
  *value = sum;
  return true;
}

}  // namespace

void AppendBigEndian32(std::string* key, uint32_t value) {
  AppendBigEndian(key, value);
}

void AppendBigEndian64(std::string* key, uint64_t value) {
  AppendBigEndian(key, value);
}

bool TakeBigEndian32(std::string_view* key, uint32_t* value) {
  return TakeBigEndian(key, value);
}

bool TakeBigEndian64(std::string_view* key, uint64_t* value) {
  return TakeBigEndian(key, value);
}

std::string Key32(uint32_t value) {
  std::string key;
  AppendBigEndian(&key, value);
  return key;
}

std::string Key32x2(uint32_t first, uint32_t second) {
  std::string key = Key32(first);
  AppendBigEndian(&key, second);
  return key;
}

std::string TaggedKey(uint8_t tag, std::string_view rest) {
  std::string key(1, static_cast<char>(tag));
  key += rest;
  return key;
}

Status ParseId(std::string_view key, uint32_t* id) {
  if (!TakeBigEndian32(&key, id) || !key.empty())
    return Status::Corruption("a key of wrong length");
  return *id != 0 ? Status::Ok() : Status::Corruption("a key with id 0");
}

std::string PrefixEnd(std::string_view prefix) {
  std::string end(prefix);
  while (!end.empty() && static_cast<uint8_t>(end.back()) == 0xFF) end.pop_back();
  if (!end.empty()) {
    ++end.back();
    return end;
  }
  // All bytes 255: only longer keys lie above. Ours have at most 40 bytes after a prefix.
  return std::string(prefix) + std::string(64, '\xFF');
}

std::string KeyText(std::string_view key) {
  const bool printable = !key.empty() && std::all_of(key.begin(), key.end(),
                                                     [](char c) { return c >= ' ' && c <= '~'; });
  if (printable) return "'" + std::string(key) + "'";
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text = "0x";
  for (const char c : key) {
    text += kDigits[static_cast<uint8_t>(c) >> 4];
    text += kDigits[static_cast<uint8_t>(c) & 15];
  }
  return text;
}

}  // namespace veduta
