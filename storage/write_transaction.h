// SPDX-License-Identifier: Apache-2.0
#pragma once
// The Transaction over RocksDB: one write batch, applied by DatabaseFiles::Commit.

#include <memory>

#include "storage/database_files.h"
#include "storage/transaction.h"
#include "storage/write_ahead.h"

namespace veduta {

// The files and claims stay alive as long as it lives.
std::unique_ptr<Transaction> MakeTransaction(std::shared_ptr<DatabaseFiles> files,
                                             std::shared_ptr<PhotoClaims> claims);

}  // namespace veduta
