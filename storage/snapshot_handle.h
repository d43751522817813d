// SPDX-License-Identifier: Apache-2.0
#pragma once
// RocksDB's snapshot, which is given back when its owner goes or when the files close, whichever
// comes first.

#include <rocksdb/db.h>

#include <cstdint>
#include <memory>
#include <utility>

#include "storage/database_files.h"

namespace veduta {

class SnapshotHandle final : private DatabaseFiles::Dependent {
 public:
  explicit SnapshotHandle(std::shared_ptr<const DatabaseFiles> files) : files_(std::move(files)) {
    const FilesLease lease(*files_);
    if (!lease.status().ok()) return;  // every later lease says why, too
    snapshot_ = files_->db().GetSnapshot();
    sequence_ = snapshot_->GetSequenceNumber();
    files_->Register(this);
  }
  ~SnapshotHandle() { files_->Unregister(this); }
  SnapshotHandle(const SnapshotHandle&) = delete;
  SnapshotHandle& operator=(const SnapshotHandle&) = delete;

  // For the holder of a lease.
  const rocksdb::Snapshot* get() const { return snapshot_; }
  uint64_t sequence() const { return sequence_; }  // 0 when the files were closed already

 private:
  void GiveBack() override { files_->db().ReleaseSnapshot(std::exchange(snapshot_, nullptr)); }

  const std::shared_ptr<const DatabaseFiles> files_;
  const rocksdb::Snapshot* snapshot_ = nullptr;
  uint64_t sequence_ = 0;
};

}  // namespace veduta
