// SPDX-License-Identifier: Apache-2.0
#include "storage/durable_folder.h"

#include <memory>

#include "storage/rocksdb_status.h"

namespace veduta {

Status MakeFolderDurable(rocksdb::FileSystem& file_system, const std::string& folder) {
  std::unique_ptr<rocksdb::FSDirectory> directory;
  rocksdb::IOStatus status =
      file_system.NewDirectory(folder, rocksdb::IOOptions(), &directory, nullptr);
  if (status.ok()) status = directory->Fsync(rocksdb::IOOptions(), nullptr);
  return FromRocksdb(status, "make folder " + folder + " durable");
}

}  // namespace veduta
