// SPDX-License-Identifier: Apache-2.0
#pragma once
// A text file as one string.

#include <cstddef>
#include <string>

#include "storage/base/status.h"

namespace veduta {

// All bytes of the file at `path`, of which there may be `size_bytes_max` at most. kIoError, with
// the path, for a folder or a file that cannot be read; kInvalidArgument for a larger file.
Result<std::string> ReadWholeFile(const std::string& path, size_t size_bytes_max);

}  // namespace veduta
