// SPDX-License-Identifier: Apache-2.0
#pragma once
// A file that the user asked for.

#include <string>
#include <string_view>

#include "storage/base/status.h"

namespace veduta {

// Writes the bytes to the file at `path`, in place of what it held. kIoError with the path and the
// operating system's word.
Status WriteResultFile(const std::string& path, std::string_view bytes);

}  // namespace veduta
