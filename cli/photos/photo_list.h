// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which files an `add` means, and what they are called in the database.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "storage/base/status.h"

namespace veduta {

// The largest list that is read, in bytes; chosen by hand, not measured: a million long paths.
inline constexpr size_t kPhotoListBytesMax = 256 << 20;

struct ListedPhoto {
  std::string name;  // in the database
  std::string path;
  std::string camera;  // empty: the one that the command names
};

// A path that is a file stands for itself and is named by its file name. A path that is a folder
// stands for all regular files below it, in the order of their paths, named relative to the folder;
// files and folders whose names begin with a dot are passed over. What else is passed over below a
// folder (links that lead in a circle, to nothing or to a folder; pipes, sockets, devices) goes
// into `passed_over`, one sentence each, with its path. kNotFound for a path that does not exist.
Result<std::vector<ListedPhoto>> ListPhotos(const std::vector<std::string>& paths,
                                            std::vector<std::string>* passed_over);

// Reads a list file: one path per line, with a tab and the name of a camera after it where the
// photo has another than the command names. Empty lines and lines that begin with '#' are passed
// over; the order is kept. Where `folder` is given, the paths are relative to it and are the names;
// otherwise the names are relative to the deepest folder that all paths have in common. kIoError
// where the list cannot be read, kInvalidArgument where a line names no file.
Result<std::vector<ListedPhoto>> ReadPhotoList(const std::string& list_path,
                                               const std::string& folder);
// The same from the list's text. Safe on any bytes.
Result<std::vector<ListedPhoto>> ParsePhotoList(std::string_view text, const std::string& folder);

}  // namespace veduta
