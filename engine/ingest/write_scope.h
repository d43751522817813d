// SPDX-License-Identifier: Apache-2.0
#pragma once
// A transaction with the state that it is computed from.

#include <memory>

#include "storage/database.h"

namespace veduta {

struct WriteScope {
  std::unique_ptr<Transaction> transaction;
  std::shared_ptr<const Snapshot> base;
};

// Whatever another transaction commits after `base` was taken makes this one's commit fail with
// kBusy, and is never overwritten unseen.
inline WriteScope BeginWrite(Database* database) {
  WriteScope scope;
  scope.transaction = database->BeginTransaction();
  scope.base = scope.transaction->base();
  return scope;
}

}  // namespace veduta
