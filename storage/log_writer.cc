// SPDX-License-Identifier: Apache-2.0
#include "storage/log_writer.h"

#include <algorithm>

#include "storage/log_format.h"
#include "storage/rocksdb_status.h"

namespace veduta {
namespace {

FragmentType TypeOf(bool is_first, bool is_last) {
  if (is_first) return is_last ? FragmentType::kFull : FragmentType::kFirst;
  return is_last ? FragmentType::kLast : FragmentType::kMiddle;
}

}  // namespace

Result<LogWriter> LogWriter::Make(rocksdb::FileSystem& file_system, const std::string& path) {
  LogWriter writer;
  writer.path_ = path;
  VEDUTA_RETURN_IF_ERROR(
      FromRocksdb(file_system.NewWritableFile(path, rocksdb::FileOptions(), &writer.file_, nullptr),
                  "write " + path));
  return writer;
}

Status LogWriter::Append(std::string_view bytes) {
  block_used_bytes_ += bytes.size();
  return FromRocksdb(file_->Append({bytes.data(), bytes.size()}, rocksdb::IOOptions(), nullptr),
                     "write " + path_);
}

Status LogWriter::Add(std::string_view record) {
  bool is_first = true;
  do {
    const size_t left = kLogBlockBytes - block_used_bytes_;
    if (left < kFragmentHeaderBytes) {
      VEDUTA_RETURN_IF_ERROR(Append(std::string(left, '\0')));
      block_used_bytes_ = 0;
    }
    const size_t room = kLogBlockBytes - block_used_bytes_ - kFragmentHeaderBytes;
    const std::string_view data = record.substr(0, std::min(room, record.size()));
    record.remove_prefix(data.size());
    const FragmentType type = TypeOf(is_first, record.empty());
    std::string fragment;
    AppendLittleEndian(FragmentChecksum(type, data), &fragment);
    AppendLittleEndian(static_cast<uint16_t>(data.size()), &fragment);
    fragment.push_back(static_cast<char>(type));
    fragment.append(data);
    VEDUTA_RETURN_IF_ERROR(Append(fragment));
    is_first = false;
  } while (!record.empty());
  return Status::Ok();
}

Status LogWriter::Finish() {
  rocksdb::IOStatus status = file_->Fsync(rocksdb::IOOptions(), nullptr);
  if (status.ok()) status = file_->Close(rocksdb::IOOptions(), nullptr);
  return FromRocksdb(status, "write " + path_);
}

}  // namespace veduta
