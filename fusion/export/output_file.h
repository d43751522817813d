// SPDX-License-Identifier: Apache-2.0
#pragma once
// A file that is written from its beginning to its end, whose failures name it.

#include <cerrno>
#include <cstring>
#include <fstream>
#include <string>
#include <utility>

#include "storage/base/status.h"

namespace veduta {

class OutputFile final {
 public:
  // What is at the path is replaced. Whether that went well, Check says.
  explicit OutputFile(std::string path)
      : path_(std::move(path)), file_(path_, std::ios::binary | std::ios::trunc) {}

  std::ostream& stream() { return file_; }
  // kIoError with the path, where anything failed so far.
  Status Check() const {
    return file_ ? Status::Ok()
                 : Status::IoError("cannot write " + path_ + ": " + std::strerror(errno));
  }
  // As Check, once all is with the operating system.
  Status Close() {
    file_.close();
    return Check();
  }

 private:
  const std::string path_;
  std::ofstream file_;
};

}  // namespace veduta
