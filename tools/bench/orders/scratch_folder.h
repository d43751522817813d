// SPDX-License-Identifier: Apache-2.0
#pragma once
// A folder for files that nobody wants afterwards.

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <string>
#include <utility>

#include "storage/base/status.h"

namespace veduta::orders {

// A new empty folder below the system's folder for temporary files; deleted with all that is in it
// when this object ends, unless it is kept.
class ScratchFolder final {
 public:
  static Result<ScratchFolder> Make() {
    std::error_code error;
    const std::filesystem::path parent = std::filesystem::temp_directory_path(error);
    std::string pattern = (parent / "veduta-orders-XXXXXX").string();
    if (error || mkdtemp(pattern.data()) == nullptr)
      return Status::IoError("cannot make a folder in " + parent.string());
    return ScratchFolder(pattern);
  }
  ScratchFolder(ScratchFolder&& other) noexcept : path_(std::exchange(other.path_, {})) {}
  ScratchFolder& operator=(ScratchFolder&& other) noexcept {
    std::swap(path_, other.path_);
    return *this;
  }
  ~ScratchFolder() {
    std::error_code ignored;  // what is left there is left to the system
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }

  const std::filesystem::path& path() const { return path_; }
  std::string Keep() { return std::exchange(path_, {}).string(); }

 private:
  explicit ScratchFolder(std::filesystem::path path) : path_(std::move(path)) {}
  std::filesystem::path path_;
};

}  // namespace veduta::orders
