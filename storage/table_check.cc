// SPDX-License-Identifier: Apache-2.0
#include "storage/table_check.h"

#include <rocksdb/options.h>
#include <rocksdb/sst_file_reader.h>

#include <algorithm>
#include <cstring>
#include <filesystem>

#include "storage/crc32c.h"
#include "storage/file_copy.h"
#include "storage/rocksdb_status.h"

namespace veduta {
namespace {

// A blob file begins with a header: magic number, version and family, each u32, flags and
// compression, a byte each, and two expirations, each u64. It ends with a footer, whose last four
// bytes are its checksum. A record is a header and then key and value: lengths of both and an
// expiration, each u64, the checksum of these, and that of key and value, each u32. Numbers are
// little-endian.
constexpr size_t kFileHeaderBytes = 30, kFooterBytes = 32, kRecordHeaderBytes = 32;

constexpr uint32_t kMagicNumber = 2395959, kVersion = 1;

uint32_t NumberAt(std::string_view bytes, size_t offset) {
  uint32_t value = 0;
  std::memcpy(&value, bytes.data() + offset, sizeof(value));
  return value;
}

// Family and compression may be any: RocksDB compares them with the table's.
bool IsHeader(std::string_view bytes) {
  const std::string_view expirations = bytes.substr(14);
  return NumberAt(bytes, 0) == kMagicNumber && NumberAt(bytes, 4) == kVersion && bytes[12] == 0 &&
         std::ranges::all_of(expirations, [](char c) { return c == 0; });
}

bool EndsWithChecksum(std::string_view bytes) {
  const size_t size = bytes.size() - 4;
  return MaskCrc32c(ExtendCrc32c(0, bytes.substr(0, size))) == NumberAt(bytes, size);
}

// Reads a blob file as its bytes come.
class BlobFileCheck final {
 public:
  explicit BlobFileCheck(uint64_t size_bytes) : size_bytes_(size_bytes) {}

  // False where the bytes contradict a checksum.
  bool Take(std::string_view piece) {
    while (!piece.empty()) {
      const size_t taken = left_ > 0 ? TakeOfRecord(piece) : TakeOfHeader(piece);
      piece.remove_prefix(taken);
      offset_ += taken;
      if (left_ == 0 && !FinishPart()) return false;
    }
    return true;
  }
  bool has_ended() const { return has_footer_ && offset_ == size_bytes_; }
  uint64_t part_offset() const { return part_offset_; }

 private:
  // How long what comes at `part_offset_` is, which is no key or value.
  size_t HeadBytes() const {
    if (part_offset_ == 0) return kFileHeaderBytes;
    return kRecordHeaderBytes;  // as long as the footer
  }
  size_t TakeOfHeader(std::string_view piece) {
    const size_t taken = std::min(piece.size(), HeadBytes() - head_.size());
    head_.append(piece.substr(0, taken));
    return taken;
  }
  size_t TakeOfRecord(std::string_view piece) {
    const size_t taken = static_cast<size_t>(std::min<uint64_t>(piece.size(), left_));
    crc_ = ExtendCrc32c(crc_, piece.substr(0, taken));
    left_ -= taken;
    return taken;
  }

  // Called where no byte of a record's key and value is left.
  bool FinishPart() {
    if (head_.size() < HeadBytes()) return true;
    if (part_offset_ == 0) return IsHeader(head_) && Begin();
    if (is_in_record_)
      return MaskCrc32c(crc_) == NumberAt(head_, kRecordHeaderBytes - 4) && Begin();
    if (offset_ == size_bytes_) return has_footer_ = EndsWithChecksum(head_);
    if (!EndsWithChecksum(std::string_view(head_).substr(0, kRecordHeaderBytes - 4))) return false;
    uint64_t key = 0, value = 0;
    std::memcpy(&key, head_.data(), 8);
    std::memcpy(&value, head_.data() + 8, 8);
    is_in_record_ = true;
    left_ = key + value;
    crc_ = 0;
    return left_ > 0 && key <= size_bytes_ && value <= size_bytes_;
  }
  bool Begin() {
    head_.clear();
    is_in_record_ = false;
    part_offset_ = offset_;
    return true;
  }

  const uint64_t size_bytes_;
  uint64_t offset_ = 0, part_offset_ = 0;
  std::string head_;  // of the file, of a record, or the footer, as far as it has come
  bool is_in_record_ = false, has_footer_ = false;
  uint64_t left_ = 0;  // of the record's key and value
  uint32_t crc_ = 0;
};

Status CheckBlobFile(const std::string& path, const std::stop_token& stop) {
  std::error_code error;
  BlobFileCheck check(std::filesystem::file_size(path, error));
  if (error) return Status::IoError("cannot read " + path + ": " + error.message());
  const auto damaged = [&] {
    return Status::Corruption(path + " is damaged in what begins at byte " +
                              std::to_string(check.part_offset()));
  };
  VEDUTA_RETURN_IF_ERROR(ReadPieces(path, stop, [&](std::string_view piece) {
    return check.Take(piece) ? Status::Ok() : damaged();
  }));
  return check.has_ended() ? Status::Ok() : damaged();
}

}  // namespace

Status CheckStoredFile(const std::string& path, const std::stop_token& stop) {
  if (path.ends_with(".blob")) return CheckBlobFile(path, stop);
  if (!path.ends_with(".sst")) return Status::Ok();
  rocksdb::SstFileReader reader{rocksdb::Options()};
  VEDUTA_RETURN_IF_ERROR(FromRocksdb(reader.Open(path), "read " + path));
  return FromRocksdb(reader.VerifyChecksum(), "read " + path);
}

}  // namespace veduta
