// SPDX-License-Identifier: Apache-2.0
#pragma once
// The operating system's errors as a Status.

#include <string>
#include <system_error>

#include "storage/base/status.h"

namespace veduta {

// kIoError "cannot DOING: " and the system's word, where there is an error.
inline Status FromSystem(const std::error_code& error, const std::string& doing) {
  if (!error) return Status::Ok();
  return Status::IoError("cannot " + doing + ": " + error.message());
}

}  // namespace veduta
