// SPDX-License-Identifier: Apache-2.0
#include "cli/command.h"

#include <cstdio>

namespace veduta {

int ExitCodeOf(const Status& status) {
  switch (status.code()) {
    case StatusCode::kOk:
      return kDone;
    case StatusCode::kBusy:
    case StatusCode::kCorruption:
      return kDatabaseUnusable;
    default:
      return kNotDone;
  }
}

int Fail(const Status& status) {
  std::fprintf(stderr, "veduta: %s\n", Printable(status.message()).c_str());
  return ExitCodeOf(status);
}

int FailUsage(const Status& status) {
  Fail(status);
  return kBadUsage;
}

Result<std::unique_ptr<Engine>> OpenToRead(const std::string& path) {
  EngineOptions options;
  options.read_only = true;
  return Engine::Open(path, options);
}

Result<std::unique_ptr<Engine>> OpenToWrite(const std::string& path, const EngineOptions& options) {
  return Engine::Open(path, options);
}

}  // namespace veduta
