// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which files an `add` means, and what they are called in the database.

#include <string>
#include <vector>

#include "storage/base/status.h"

namespace veduta {

struct ListedPhoto {
  std::string name;  // in the database
  std::string path;
  std::string camera;  // empty: the command's
};

// Files as they are, named by their file name; folders with all regular files below them, in the
// order of their names, named relative to the folder; hidden files and folders are passed over.
// kNotFound for what does not exist.
Result<std::vector<ListedPhoto>> ListPhotos(const std::vector<std::string>& paths);

// A list file: a path a line, optionally a tab and a camera's name; `#` starts a comment; order is
// kept. Paths are relative to `folder` where one is given and named relative to it; otherwise they
// are named relative to the deepest folder common to all.
Result<std::vector<ListedPhoto>> ReadPhotoList(const std::string& list_path,
                                               const std::string& folder);

}  // namespace veduta
