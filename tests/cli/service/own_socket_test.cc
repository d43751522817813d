// SPDX-License-Identifier: Apache-2.0
// Goal: a daemon is reached by the socket in its database's folder, by its owner alone, wherever
//   the folder is; one that has gone is reached by nobody.
// Method: sockets in folders of the test's own, one of them with a path that is longer than an
//   address of a socket may be.
#include "cli/service/own_socket.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

TEST(OwnSocket, IsReachedByItsOwner) {
  const TemporaryFolder folder;
  const std::string database = folder / std::string(200, 'd');
  std::filesystem::create_directory(database);
  EXPECT_FALSE(ConnectToSocket(database)) << "nobody listens";
  {
    const auto listening = ListenAtSocket(database);
    ASSERT_OK(listening);
    struct stat facts {};
    ASSERT_EQ(lstat((database + "/" + kSocketName).c_str(), &facts), 0);
    EXPECT_TRUE(S_ISSOCK(facts.st_mode));
    EXPECT_EQ(facts.st_mode & 0777u, 0600u);
    EXPECT_TRUE(ConnectToSocket(database));
  }
  EXPECT_FALSE(ConnectToSocket(database)) << "it is there, as after a kill, and nobody listens";
  ASSERT_OK(ListenAtSocket(database)) << "it takes the place of the other";
  RemoveSocket(database);
  EXPECT_TRUE(std::filesystem::is_empty(database));
}

TEST(OwnSocket, NeedsAFolder) {
  const TemporaryFolder folder;
  EXPECT_EQ(ListenAtSocket(folder / "none").status().code(), StatusCode::kIoError);
  EXPECT_FALSE(ConnectToSocket(folder / "none"));
}

}  // namespace
}  // namespace veduta
