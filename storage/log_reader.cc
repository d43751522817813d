// SPDX-License-Identifier: Apache-2.0
#include "storage/log_reader.h"

#include <algorithm>
#include <memory>
#include <optional>

#include "storage/log_format.h"
#include "storage/rocksdb_status.h"

namespace veduta {
namespace {

// What Linux writes to a disk at once. A page that was written again as the log grew may lack its
// later part; a disk may write it to a boundary of its own.
constexpr size_t kPageBytes = 4096;
constexpr size_t kSectorBytes = 512;  // the smallest there are

bool IsZeros(std::string_view bytes) {
  return std::all_of(bytes.begin(), bytes.end(), [](char c) { return c == 0; });
}

struct Fragment {
  FragmentType type = FragmentType::kNothing;
  std::string_view data;
};

// The fragment at `offset` of a block, if there is a whole one with the right checksum.
std::optional<Fragment> FragmentAt(std::string_view block, size_t offset) {
  if (offset + kFragmentHeaderBytes > block.size()) return std::nullopt;
  const auto type = static_cast<FragmentType>(block[offset + 6]);
  if (type < FragmentType::kFull || type > FragmentType::kLast) return std::nullopt;
  const size_t length = LittleEndianAt<uint16_t>(block, offset + 4);
  if (offset + kFragmentHeaderBytes + length > block.size()) return std::nullopt;
  const std::string_view data = block.substr(offset + kFragmentHeaderBytes, length);
  if (FragmentChecksum(type, data) != LittleEndianAt<uint32_t>(block, offset)) return std::nullopt;
  return Fragment{type, data};
}

enum class RecordKind : uint8_t { kBatch, kManifestEdit };

// Takes the blocks of one file and makes pieces of them.
class LogParser final {
 public:
  LogParser(RecordKind kind, const std::function<Status(const LogPiece&)>& visit)
      : kind_(kind), visit_(visit) {}

  // `block` lies at begin_bytes of the file, and is shorter than others only at the file's end.
  Status TakeBlock(std::string_view block, uint64_t begin_bytes) {
    size_t offset = 0;
    while (offset + kFragmentHeaderBytes <= block.size()) {
      const std::optional<Fragment> fragment = FragmentAt(block, offset);
      if (fragment) {
        VEDUTA_RETURN_IF_ERROR(TakeFragment(*fragment, begin_bytes + offset));
        offset += kFragmentHeaderBytes + fragment->data.size();
        continue;
      }
      const size_t next = NextFragment(block, offset);
      const bool is_torn = next == block.size() && EndsWithin(block, offset);
      Spoil(begin_bytes + offset, begin_bytes + next,
            is_torn || HasUnwrittenPart(block, offset, next));
      offset = next;
    }
    if (block.size() < kLogBlockBytes && offset < block.size())  // a header without its end
      Spoil(begin_bytes + offset, begin_bytes + block.size(), true);
    return Status::Ok();
  }

  Status Finish(uint64_t size_bytes) {
    if (in_record_) {
      Spoil(record_begin_bytes_, size_bytes, true);
    }
    return TellSpoiled();
  }

 private:
  static size_t NextFragment(std::string_view block, size_t offset) {
    // The length may be right, and only the data be damaged.
    const size_t length = LittleEndianAt<uint16_t>(block, offset + 4);
    const size_t behind = offset + kFragmentHeaderBytes + length;
    if (FragmentAt(block, behind)) return behind;
    for (size_t next = offset + 1; next + kFragmentHeaderBytes <= block.size(); ++next) {
      if (FragmentAt(block, next)) return next;
    }
    return block.size();
  }

  // Whether the file ends before the fragment at `offset` does: only its last block is shorter.
  static bool EndsWithin(std::string_view block, size_t offset) {
    const size_t length = LittleEndianAt<uint16_t>(block, offset + 4);
    return block.size() < kLogBlockBytes && offset + kFragmentHeaderBytes + length > block.size();
  }

  // Whether within [begin, end) a whole sector is zeros, or what lies there of the last sector of a
  // page or of the file. Blocks begin at multiples of the page's size.
  static bool HasUnwrittenPart(std::string_view block, size_t begin, size_t end) {
    for (size_t sector = begin / kSectorBytes * kSectorBytes; sector < end;
         sector += kSectorBytes) {
      const size_t sector_end = std::min(sector + kSectorBytes, block.size());
      const bool ends_page = sector_end % kPageBytes == 0 || sector_end == block.size();
      if (sector_end > end || (sector < begin && !ends_page)) continue;
      const size_t from = std::max(begin, sector);
      if (IsZeros(block.substr(from, sector_end - from))) return true;
    }
    return false;
  }

  Status TakeFragment(const Fragment& fragment, uint64_t begin_bytes) {
    const uint64_t end_bytes = begin_bytes + kFragmentHeaderBytes + fragment.data.size();
    const bool begins =
        fragment.type == FragmentType::kFull || fragment.type == FragmentType::kFirst;
    if (begins && in_record_) Spoil(record_begin_bytes_, begin_bytes, false);
    if (!begins && !in_record_) {  // what it belongs to is lost
      Spoil(begin_bytes, end_bytes, false);
      return Status::Ok();
    }
    if (fragment.type == FragmentType::kFull)
      return TellRecord(fragment.data, begin_bytes, end_bytes);
    if (fragment.type == FragmentType::kFirst) {
      in_record_ = true;
      record_begin_bytes_ = begin_bytes;
      record_.clear();
    }
    record_.append(fragment.data);
    if (fragment.type != FragmentType::kLast) return Status::Ok();
    in_record_ = false;
    return TellRecord(record_, record_begin_bytes_, end_bytes);
  }

  Status TellRecord(std::string_view record, uint64_t begin_bytes, uint64_t end_bytes) {
    if (kind_ == RecordKind::kBatch && record.size() < kBatchHeaderBytes) {
      Spoil(begin_bytes, end_bytes, false);
      return Status::Ok();
    }
    VEDUTA_RETURN_IF_ERROR(TellSpoiled());
    LogPiece piece;
    piece.begin_bytes = begin_bytes;
    piece.end_bytes = end_bytes;
    piece.readable = true;
    piece.record = record;
    if (kind_ == RecordKind::kBatch) {
      piece.sequence = LittleEndianAt<uint64_t>(record, 0);
      piece.count = LittleEndianAt<uint32_t>(record, 8);
    }
    return visit_(piece);
  }

  // What is not readable becomes one piece up to the next batch.
  void Spoil(uint64_t begin_bytes, uint64_t end_bytes, bool may_be_unwritten) {
    if (in_record_) begin_bytes = std::min(begin_bytes, record_begin_bytes_);
    in_record_ = false;
    if (!spoiled_) spoiled_.emplace().begin_bytes = begin_bytes;
    spoiled_->end_bytes = std::max(spoiled_->end_bytes, end_bytes);
    spoiled_->may_be_unwritten = spoiled_->may_be_unwritten || may_be_unwritten;
  }

  Status TellSpoiled() {
    if (!spoiled_) return Status::Ok();
    const LogPiece piece = *spoiled_;
    spoiled_.reset();
    return visit_(piece);
  }

  const RecordKind kind_;
  const std::function<Status(const LogPiece&)>& visit_;
  bool in_record_ = false;  // a first fragment was read, and its last one was not
  uint64_t record_begin_bytes_ = 0;
  std::string record_;
  std::optional<LogPiece> spoiled_;
};

Status ReadRecords(rocksdb::FileSystem& file_system, const std::string& path, RecordKind kind,
                   const std::function<Status(const LogPiece&)>& visit) {
  const std::string doing = "read " + path;
  std::unique_ptr<rocksdb::FSSequentialFile> file;
  VEDUTA_RETURN_IF_ERROR(FromRocksdb(
      file_system.NewSequentialFile(path, rocksdb::FileOptions(), &file, nullptr), doing));
  constexpr size_t kReadBytes = 32 * kLogBlockBytes;  // 1 MiB; chosen by hand, not measured
  std::string buffer(kReadBytes, '\0');
  LogParser parser(kind, visit);
  uint64_t offset = 0;
  for (bool at_end = false; !at_end;) {
    size_t filled = 0;
    while (filled < kReadBytes && !at_end) {
      rocksdb::Slice got;
      VEDUTA_RETURN_IF_ERROR(FromRocksdb(file->Read(kReadBytes - filled, rocksdb::IOOptions(), &got,
                                                    buffer.data() + filled, nullptr),
                                         doing));
      if (!got.empty() && got.data() != buffer.data() + filled)
        std::memmove(buffer.data() + filled, got.data(), got.size());
      filled += got.size();
      at_end = got.empty();
    }
    const std::string_view bytes(buffer.data(), filled);
    for (size_t block = 0; block < filled; block += kLogBlockBytes)
      VEDUTA_RETURN_IF_ERROR(parser.TakeBlock(bytes.substr(block, kLogBlockBytes), offset + block));
    offset += filled;
  }
  return parser.Finish(offset);
}

}  // namespace

Status ReadLog(rocksdb::FileSystem& file_system, const std::string& path,
               const std::function<Status(const LogPiece&)>& visit) {
  return ReadRecords(file_system, path, RecordKind::kBatch, visit);
}

Status ReadManifest(rocksdb::FileSystem& file_system, const std::string& path,
                    const std::function<Status(const LogPiece&)>& visit) {
  return ReadRecords(file_system, path, RecordKind::kManifestEdit, visit);
}

}  // namespace veduta
