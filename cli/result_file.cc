// SPDX-License-Identifier: Apache-2.0
#include "cli/result_file.h"

#include <cerrno>
#include <cstring>
#include <fstream>

namespace veduta {

Status WriteResultFile(const std::string& path, std::string_view bytes) {
  errno = 0;
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (file) return Status::Ok();
  return Status::IoError("cannot write " + path + ": " + std::strerror(errno));
}

}  // namespace veduta
