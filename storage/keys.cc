// SPDX-License-Identifier: Apache-2.0
#include "storage/keys.h"

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

template <typename Tag>
std::string Tagged(Tag tag, std::string_view rest) {
  std::string key(1, static_cast<char>(tag));
  key += rest;
  return key;
}

std::string_view HashBytes(const ContentHash& hash) {
  return {reinterpret_cast<const char*>(hash.bytes.data()), hash.bytes.size()};
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

std::string CameraKey(CameraId id) {
  return Key32(id.value);
}
std::string ImageKey(ImageId id) {
  return Key32(id.value);
}
std::string ReconstructionKey(ReconstructionId id) {
  return Key32(id.value);
}
std::string HashKey(const ContentHash& hash) {
  return std::string(HashBytes(hash));
}

bool ParseHashKey(std::string_view key, ContentHash* hash) {
  if (key.size() != hash->bytes.size()) return false;
  std::copy(key.begin(), key.end(), hash->bytes.begin());
  return true;
}

std::string NeighborPrefix(ImageId image) {
  return Tagged(PairEntry::kNeighbor, Key32(image.value));
}
std::string NeighborKey(ImageId image, ImageId other) {
  return Tagged(PairEntry::kNeighbor, Key32x2(image.value, other.value));
}
std::string PairKey(ImageId smaller, ImageId larger) {
  return Tagged(PairEntry::kRecord, Key32x2(smaller.value, larger.value));
}

std::string PointBlockPrefix(ReconstructionId reconstruction, uint32_t generation) {
  return Key32x2(reconstruction.value, generation);
}
std::string PointBlockKey(ReconstructionId reconstruction, uint32_t generation, ImageId home) {
  std::string key = PointBlockPrefix(reconstruction, generation);
  AppendBigEndian(&key, home.value);
  return key;
}

std::string VocabularyKey(uint32_t generation) {
  return Key32(generation);
}
std::string WordsKey(uint32_t generation, ImageId image) {
  return Key32x2(generation, image.value);
}
std::string PostingsKey(uint32_t generation, WordId word) {
  return Key32x2(generation, word);
}

std::string JournalKey(uint64_t sequence) {
  std::string key;
  AppendBigEndian(&key, sequence);
  return key;
}

std::string PhotoMarkKey(const ContentHash& photo) {
  return Tagged(MarkKind::kPhoto, HashBytes(photo));
}
bool ParsePhotoMarkKey(std::string_view key, ContentHash* photo) {
  if (key.empty() || key[0] != static_cast<char>(MarkKind::kPhoto)) return false;
  return ParseHashKey(key.substr(1), photo);
}
std::string PointBlocksMarkKey(ReconstructionId reconstruction, uint32_t generation) {
  return Tagged(MarkKind::kPointBlocks, Key32x2(reconstruction.value, generation));
}
std::string VocabularyMarkKey(uint32_t generation) {
  return Tagged(MarkKind::kVocabulary, Key32(generation));
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
