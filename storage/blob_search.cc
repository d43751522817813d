// SPDX-License-Identifier: Apache-2.0
#include "storage/blob_search.h"

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace veduta {
namespace {

// blob_log_format.h of RocksDB 7.8. A file begins with a header; a record is a header, a key and a
// value. Numbers are little-endian.
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

// Whether a record of any family may lie there, with `left` bytes from its header to the file's
// end.
bool IsPlausible(const RecordHeader& header, uint64_t left) {
  return header.expiration == 0 && header.key_bytes >= 1 && header.key_bytes <= left &&
         header.value_bytes <= left &&
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
  char bytes[kRecordHeaderBytes + kKeyBytes];
  while (offset + sizeof(bytes) <= end) {
    if (!ReadAt(file, offset, bytes, sizeof(bytes))) return;
    const RecordHeader header = ParseHeader(bytes);
    if (!IsPlausible(header, end - offset)) {
      offset = NextHeader(file, offset + 1, end);
      continue;
    }
    if (header.key_bytes == kKeyBytes) {
      ContentHash hash;
      std::memcpy(hash.bytes.data(), bytes + kRecordHeaderBytes, kKeyBytes);
      places_.insert(
          {hash, {file_index, offset + kRecordHeaderBytes + kKeyBytes, header.value_bytes}});
    }
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

std::optional<std::vector<uint8_t>> BlobSearch::Find(const ContentHash& photo) const {
  const auto [first, last] = places_.equal_range(photo);
  for (auto it = first; it != last; ++it) {
    if (auto bytes = Read(it->second, photo)) return bytes;
  }
  return std::nullopt;
}

void BlobSearch::Scan(const std::function<bool(const ContentHash&)>& visit) const {
  for (auto it = places_.begin(); it != places_.end(); it = places_.upper_bound(it->first)) {
    if (Find(it->first) && !visit(it->first)) return;
  }
}

}  // namespace veduta
