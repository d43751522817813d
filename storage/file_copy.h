// SPDX-License-Identifier: Apache-2.0
#pragma once
// Large files, read once from end to end. Memory: 1 MiB.

#include <cstdint>
#include <functional>
#include <stop_token>
#include <string>
#include <string_view>

#include "storage/base/content_hash.h"
#include "storage/base/status.h"

namespace veduta {

// Hands the bytes over, a piece at a time; its failure ends the reading. kIoError, kCancelled.
Status ReadPieces(const std::string& path, const std::stop_token& stop,
                  const std::function<Status(std::string_view piece)>& take);
// The hash of all bytes.
Result<ContentHash> HashFile(const std::string& path, const std::stop_token& stop);
// Copies the bytes into `to`, in place of what it held, and syncs it; the hash of what was copied.
// A copy that fails is deleted.
Result<ContentHash> CopyFile(const std::string& from, const std::string& to,
                             const std::stop_token& stop);
// Writes a small file by way of a temporary one: it is there whole or not at all, and lasts.
Status WriteFileWhole(const std::string& path, std::string_view bytes);
// What was made, renamed or deleted in the folder lasts.
Status SyncFolder(const std::string& folder);

}  // namespace veduta
