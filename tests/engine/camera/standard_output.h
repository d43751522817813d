// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a piece of code, the libraries beneath it included, writes to standard output.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>

namespace veduta::testing {

// Runs `work` with file descriptor 1 pointed at a file, and returns what was written to it, by
// whatever library and by whatever means. Not for tests that run side by side in one process.
inline std::string StandardOutputOf(const std::function<void()>& work) {
  std::string path = ::testing::TempDir() + "veduta_stdout_XXXXXX";
  const int file = ::mkstemp(path.data());
  EXPECT_GE(file, 0) << path;
  std::fflush(stdout);
  const int terminal = ::dup(STDOUT_FILENO);
  ::dup2(file, STDOUT_FILENO);
  work();
  std::fflush(stdout);
  ::dup2(terminal, STDOUT_FILENO);
  ::close(terminal);
  std::string written;
  ::lseek(file, 0, SEEK_SET);
  char bytes[4096];
  for (ssize_t count; (count = ::read(file, bytes, sizeof bytes)) > 0;)
    written.append(bytes, static_cast<size_t>(count));
  ::close(file);
  ::unlink(path.c_str());
  return written;
}

}  // namespace veduta::testing
