// SPDX-License-Identifier: Apache-2.0
#pragma once
// A contributed photo's file. What goes wrong here is about the disk, the process or the path, and
// says nothing about the photo.

#include <cstdint>
#include <string>
#include <vector>

#include "storage/base/status.h"

namespace veduta {

// The size that the file has at this moment; 0 where it cannot be had.
uint64_t PhotoFileSize(const std::string& path);

// All bytes of a regular file, or the first `size_bytes_max` + 1 of them: who gets so many knows
// that the file is larger. kNotFound where there is none, otherwise kIoError; the message has the
// path and the operating system's word. Never waits for a pipe. Throws std::bad_alloc.
Result<std::vector<uint8_t>> ReadPhotoFile(const std::string& path, uint64_t size_bytes_max);

}  // namespace veduta
