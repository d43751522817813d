// SPDX-License-Identifier: Apache-2.0
#pragma once
// A file that somebody names, as one string.

#include <cstddef>
#include <string>
#include <string_view>

#include "storage/base/status.h"

namespace veduta {

// All bytes of the regular file at `path`, of which there may be `size_bytes_max` at most. Never
// waits for another process: a pipe, a device, a socket or a folder is refused before anything is
// read. kIoError, with the path and what it is, for these and for a file that cannot be read;
// kInvalidArgument for a larger file. Thread-safe.
Result<std::string> ReadWholeFile(const std::string& path, size_t size_bytes_max);

// The text without the mark of UTF-8 that some editors put before it.
inline std::string_view WithoutByteOrderMark(std::string_view text) {
  constexpr std::string_view kMark = "\xEF\xBB\xBF";
  return text.starts_with(kMark) ? text.substr(kMark.size()) : text;
}

}  // namespace veduta
