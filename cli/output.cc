// SPDX-License-Identifier: Apache-2.0
#include "cli/output.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstring>

namespace veduta {
namespace {

struct Output {
  std::FILE* file = stdout;  // null where standard output was closed from the start
  int error = 0;             // errno of the first failure
};

// One per process, as standard output itself is.
Output& TheOutput() {
  static Output output;
  return output;
}

void NoteFailure(bool failed) {
  Output& output = TheOutput();
  if (failed && output.error == 0) output.error = errno != 0 ? errno : EIO;
}

}  // namespace

void KeepOutputForResults() {
  std::fflush(stdout);
  // 3 at least: were standard error closed, its number would be the lowest that is free.
  const int results = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 3);
  TheOutput().file = results < 0 ? nullptr : fdopen(results, "w");
  NoteFailure(TheOutput().file == nullptr);
  if (dup2(STDERR_FILENO, STDOUT_FILENO) >= 0) return;
  // Standard error is closed. Were the number of standard output left free, a file of the database
  // could get it, and a library's print would go into that file.
  const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
  NoteFailure(dup2(nowhere, STDOUT_FILENO) < 0);
}

void PrintLine(const char* format, ...) {
  std::FILE* file = TheOutput().file;
  if (file == nullptr) return;
  va_list arguments;
  va_start(arguments, format);
  const bool printed = std::vfprintf(file, format, arguments) >= 0;
  va_end(arguments);
  NoteFailure(!printed || std::fputc('\n', file) == EOF || std::fflush(file) != 0);
}

void PrintJson(const Json& value) {
  PrintBytes(JsonLine(value) + "\n");
}

void PrintBytes(std::string_view bytes) {
  std::FILE* file = TheOutput().file;
  if (file == nullptr) return;
  const bool written = std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size();
  NoteFailure(!written || std::fflush(file) != 0);
}

Status OutputStatus() {
  const int error = TheOutput().error;
  if (error == 0) return Status::Ok();
  return Status::IoError("cannot write to standard output: " + std::string(std::strerror(error)));
}

}  // namespace veduta
