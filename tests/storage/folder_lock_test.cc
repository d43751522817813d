// SPDX-License-Identifier: Apache-2.0
// Goal: whoever holds the lock of a folder keeps writers out, and only as long as it is held.
// Method: a database is opened before, while and after the lock is held.
#include "storage/folder_lock.h"

#include <gtest/gtest.h>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

TEST(FolderLock, KeepsWritersOut) {
  const TemporaryFolder folder;
  DatabaseOptions options;
  options.create = true;
  { ASSERT_OK(Database::Open(folder / "db", options)); }
  {
    const auto lock = FolderLock::Take(folder / "db", nullptr);
    ASSERT_OK(lock);
    EXPECT_EQ(Database::Open(folder / "db", {}).status().code(), StatusCode::kBusy);
    EXPECT_EQ(FolderLock::Take(folder / "db", nullptr).status().code(), StatusCode::kBusy);
  }
  const auto database = Database::Open(folder / "db", {});
  ASSERT_OK(database);
  EXPECT_EQ(FolderLock::Take(folder / "db", nullptr).status().code(), StatusCode::kBusy);
}

TEST(FolderLock, SaysWhereThereIsNoFolder) {
  const TemporaryFolder folder;
  EXPECT_EQ(FolderLock::Take(folder / "none", nullptr).status().code(), StatusCode::kIoError);
}

}  // namespace
}  // namespace veduta
