// SPDX-License-Identifier: Apache-2.0
#include "storage/acknowledged.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "storage/crc32c.h"
#include "storage/durable_folder.h"
#include "storage/log_format.h"
#include "storage/rocksdb_status.h"

namespace veduta {
namespace {

// Two slots, each in a page of its own, so that a write that is torn leaves the other one.
constexpr size_t kSlotStrideBytes = 4096;
constexpr size_t kSlotBytes = 52;
constexpr size_t kSlots = 2;

struct Slot {
  uint64_t turn = 0;
  AcknowledgedMark mark;
};

std::string EncodeSlot(const Slot& slot) {
  std::string bytes;
  AppendLittleEndian(slot.turn, &bytes);
  AppendLittleEndian(slot.mark.sequence, &bytes);
  AppendLittleEndian(slot.mark.log, &bytes);
  AppendLittleEndian(slot.mark.first_log, &bytes);
  AppendLittleEndian(slot.mark.manifest.number, &bytes);
  AppendLittleEndian(slot.mark.manifest.size_bytes, &bytes);
  AppendLittleEndian(ExtendCrc32c(0, bytes), &bytes);
  return bytes;
}

std::optional<Slot> DecodeSlot(std::string_view bytes) {
  if (bytes.size() != kSlotBytes) return std::nullopt;
  const std::string_view fields = bytes.substr(0, kSlotBytes - sizeof(uint32_t));
  if (ExtendCrc32c(0, fields) != LittleEndianAt<uint32_t>(bytes, fields.size()))
    return std::nullopt;
  return Slot{LittleEndianAt<uint64_t>(bytes, 0),
              {LittleEndianAt<uint64_t>(bytes, 8),
               LittleEndianAt<uint64_t>(bytes, 16),
               LittleEndianAt<uint64_t>(bytes, 24),
               {LittleEndianAt<uint64_t>(bytes, 32), LittleEndianAt<uint64_t>(bytes, 40)}}};
}

Result<std::optional<Slot>> ReadNewestSlot(rocksdb::FileSystem& file_system,
                                           const std::string& path) {
  std::unique_ptr<rocksdb::FSRandomAccessFile> file;
  const rocksdb::IOStatus opened =
      file_system.NewRandomAccessFile(path, rocksdb::FileOptions(), &file, nullptr);
  if (opened.IsNotFound() || opened.IsPathNotFound()) return std::optional<Slot>();
  VEDUTA_RETURN_IF_ERROR(FromRocksdb(opened, "read " + path));
  std::optional<Slot> newest;
  for (size_t i = 0; i < kSlots; ++i) {
    std::array<char, kSlotBytes> scratch{};
    rocksdb::Slice got;
    VEDUTA_RETURN_IF_ERROR(
        FromRocksdb(file->Read(i * kSlotStrideBytes, kSlotBytes, rocksdb::IOOptions(), &got,
                               scratch.data(), nullptr),
                    "read " + path));
    const std::optional<Slot> slot = DecodeSlot({got.data(), got.size()});
    if (slot && (!newest || slot->turn > newest->turn)) newest = slot;
  }
  return newest;
}

Status MakeFile(rocksdb::FileSystem& file_system, const std::string& folder,
                const std::string& path) {
  const std::string zeros(kSlotStrideBytes * kSlots, '\0');
  VEDUTA_RETURN_IF_ERROR(
      FromRocksdb(rocksdb::WriteStringToFile(&file_system, zeros, path, /*should_sync=*/true),
                  "write " + path));
  return MakeFolderDurable(file_system, folder);
}

}  // namespace

Result<std::optional<AcknowledgedMark>> ReadAcknowledged(rocksdb::FileSystem& file_system,
                                                         const std::string& folder) {
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<Slot> slot,
                          ReadNewestSlot(file_system, folder + "/" + kAcknowledgedFile));
  if (!slot) return std::optional<AcknowledgedMark>();
  return std::optional(slot->mark);
}

Result<std::unique_ptr<AcknowledgedFile>> AcknowledgedFile::Open(
    std::shared_ptr<rocksdb::FileSystem> file_system, const std::string& folder,
    const AcknowledgedMark& mark) {
  const std::string path = folder + "/" + kAcknowledgedFile;
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<Slot> newest, ReadNewestSlot(*file_system, path));
  if (!newest) VEDUTA_RETURN_IF_ERROR(MakeFile(*file_system, folder, path));
  std::unique_ptr<AcknowledgedFile> file(new AcknowledgedFile);
  VEDUTA_RETURN_IF_ERROR(
      FromRocksdb(file_system->NewRandomRWFile(path, rocksdb::FileOptions(), &file->file_, nullptr),
                  "write " + path));
  file->file_system_ = std::move(file_system);
  file->mark_ = mark;
  file->turn_ = newest ? newest->turn : 0;
  VEDUTA_RETURN_IF_ERROR(file->WriteSlot());
  return file;
}

void AcknowledgedFile::Advance(uint64_t sequence, uint64_t log) {
  const std::lock_guard lock(mutex_);
  if (sequence <= mark_.sequence) return;
  mark_.sequence = sequence;
  mark_.log = log;
  WriteSlot().IgnoreBecause("an older mark claims less, and the next one is written anew");
}

void AcknowledgedFile::Finish(uint64_t sequence, const ManifestPosition& manifest) {
  const std::lock_guard lock(mutex_);
  if (sequence > mark_.sequence || manifest != mark_.manifest) {
    mark_.sequence = std::max(sequence, mark_.sequence);
    mark_.manifest = manifest;
    WriteSlot().IgnoreBecause("an older mark claims less");
  }
  file_->Sync(rocksdb::IOOptions(), nullptr).PermitUncheckedError();
}

Status AcknowledgedFile::WriteSlot() {
  ++turn_;
  return FromRocksdb(file_->Write((turn_ % kSlots) * kSlotStrideBytes, EncodeSlot({turn_, mark_}),
                                  rocksdb::IOOptions(), nullptr),
                     std::string("write ") + kAcknowledgedFile);
}

}  // namespace veduta
