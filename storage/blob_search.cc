// SPDX-License-Identifier: Apache-2.0
#include "storage/blob_search.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string_view>

namespace veduta {
namespace {

// The format of RocksDB 7.8's db/blob/blob_log_format.h. A file begins with a header; a record is a
// header, a key and a value. Numbers are little-endian.
constexpr uint64_t kFileHeaderBytes = 30;
// Lengths of key and value, expiration (0: never), each u64; two checksums, each u32.
constexpr uint64_t kRecordHeaderBytes = 32;
constexpr uint64_t kKeyBytes = 32;  // of a photo: its hash

// Where a header is damaged, the next one is searched for in pieces of this size. Chosen by hand;
// not measured.
constexpr size_t kSearchBytes = 1 << 20;

struct RecordHeader {
  uint64_t key_bytes = 0, value_bytes = 0, expiration = 0;
};

RecordHeader ParseHeader(const char* bytes) {
  RecordHeader header;
  std::memcpy(&header.key_bytes, bytes, 8);
  std::memcpy(&header.value_bytes, bytes + 8, 8);
  std::memcpy(&header.expiration, bytes + 16, 8);
  return header;
}

// Lengths of the keys of the families that are kept as blobs: vocabulary, depth (two kinds),
// surface, photos and features.
bool IsKeyLength(uint64_t bytes) {
  return bytes == 4 || bytes == 5 || bytes == 13 || bytes == 17 || bytes == kKeyBytes;
}

// Whether a record may lie there, with `left` bytes from its header to the file's end.
bool IsPlausible(const RecordHeader& header, uint64_t left) {
  return header.expiration == 0 && IsKeyLength(header.key_bytes) && header.value_bytes <= left &&
         kRecordHeaderBytes + header.key_bytes + header.value_bytes <= left;
}

bool ReadAt(std::ifstream& file, uint64_t offset, char* bytes, size_t count) {
  file.clear();
  file.seekg(static_cast<std::streamoff>(offset));
  return static_cast<bool>(file.read(bytes, static_cast<std::streamsize>(count)));
}

// The place of the next header of a record with a photo's key, from `offset` on; `end` where there
// is none.
uint64_t NextHeader(std::ifstream& file, uint64_t offset, uint64_t end) {
  std::vector<char> window;
  while (offset + kRecordHeaderBytes <= end) {
    const size_t count = static_cast<size_t>(std::min<uint64_t>(kSearchBytes, end - offset));
    window.resize(count);
    if (!ReadAt(file, offset, window.data(), count)) return end;
    for (size_t i = 0; i + kRecordHeaderBytes <= count; ++i) {
      const RecordHeader header = ParseHeader(window.data() + i);
      if (header.key_bytes == kKeyBytes && IsPlausible(header, end - offset - i)) return offset + i;
    }
    offset += count - (kRecordHeaderBytes - 1);
  }
  return end;
}

}  // namespace

BlobSearch::BlobSearch(const std::string& folder) {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (entry.path().extension() == ".blob") paths_.push_back(entry.path().string());
  }
  std::sort(paths_.begin(), paths_.end());
  for (size_t file = 0; file < paths_.size(); ++file) Index(file);
}

void BlobSearch::Index(size_t file_index) {
  std::error_code error;
  const uint64_t end = std::filesystem::file_size(paths_[file_index], error);
  std::ifstream file(paths_[file_index], std::ios::binary);
  if (error || !file) return;
  uint64_t offset = kFileHeaderBytes;
  uint64_t previous = 0;  // the header that led here; 0: none
  char bytes[kRecordHeaderBytes + kKeyBytes];
  while (offset + sizeof(bytes) <= end) {
    if (!ReadAt(file, offset, bytes, sizeof(bytes))) return;
    const RecordHeader header = ParseHeader(bytes);
    if (!IsPlausible(header, end - offset)) {
      // Either this header is damaged or the length that led here.
      const uint64_t from = previous != 0 ? previous : offset;
      offset = NextHeader(file, from + 1, end);
      gaps_.push_back({file_index, from, offset - from});
      previous = 0;
      continue;
    }
    if (header.key_bytes == kKeyBytes) {
      ContentHash hash;
      std::memcpy(hash.bytes.data(), bytes + kRecordHeaderBytes, kKeyBytes);
      places_.insert(
          {hash, {file_index, offset + kRecordHeaderBytes + kKeyBytes, header.value_bytes}});
    }
    previous = offset;
    offset += kRecordHeaderBytes + header.key_bytes + header.value_bytes;
  }
}

std::optional<std::vector<uint8_t>> BlobSearch::Read(const Place& place,
                                                     const ContentHash& photo) const {
  std::ifstream file(paths_[place.file], std::ios::binary);
  std::vector<uint8_t> bytes(place.size_bytes);
  if (!ReadAt(file, place.offset, reinterpret_cast<char*>(bytes.data()), bytes.size()))
    return std::nullopt;
  if (HashContent(bytes) != photo) return std::nullopt;
  return bytes;
}

std::optional<std::vector<uint8_t>> BlobSearch::FindInGap(const Place& gap,
                                                          const ContentHash& photo,
                                                          uint64_t size_bytes) const {
  std::ifstream file(paths_[gap.file], std::ios::binary);
  std::string bytes(gap.size_bytes, '\0');
  if (!ReadAt(file, gap.offset, bytes.data(), bytes.size())) return std::nullopt;
  const std::string_view key(reinterpret_cast<const char*>(photo.bytes.data()), kKeyBytes);
  for (size_t at = bytes.find(key); at != std::string::npos; at = bytes.find(key, at + 1)) {
    if (auto found = Read({gap.file, gap.offset + at + kKeyBytes, size_bytes}, photo)) return found;
  }
  return std::nullopt;
}

std::optional<std::vector<uint8_t>> BlobSearch::Find(const ContentHash& photo,
                                                     uint64_t size_bytes) const {
  const auto [first, last] = places_.equal_range(photo);
  for (auto it = first; it != last; ++it) {
    if (auto bytes = Read(it->second, photo)) return bytes;
  }
  if (size_bytes == 0) return std::nullopt;
  for (auto it = first; it != last; ++it) {
    // The length is damaged.
    if (auto bytes = Read({it->second.file, it->second.offset, size_bytes}, photo)) return bytes;
  }
  for (const auto& [key, place] : places_) {
    if (place.size_bytes != size_bytes) continue;
    // The key is damaged.
    if (auto bytes = Read(place, photo)) return bytes;
  }
  for (const Place& gap : gaps_) {
    if (auto bytes = FindInGap(gap, photo, size_bytes)) return bytes;
  }
  return std::nullopt;
}

void BlobSearch::Scan(const std::function<bool(const ContentHash&)>& visit) const {
  for (auto it = places_.begin(); it != places_.end(); it = places_.upper_bound(it->first)) {
    if (Find(it->first, 0) && !visit(it->first)) return;
  }
}

}  // namespace veduta
