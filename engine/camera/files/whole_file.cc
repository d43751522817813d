// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/files/whole_file.h"

#include <filesystem>
#include <fstream>

namespace veduta {

Result<std::string> ReadWholeFile(const std::string& path, size_t size_bytes_max) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return Status::IoError(path + " is a folder");
  std::ifstream file(path, std::ios::binary);
  if (!file) return Status::IoError("cannot open " + path);
  std::string bytes(64 << 10, '\0');
  std::string text;
  while (file.read(bytes.data(), static_cast<std::streamsize>(bytes.size())), file.gcount() > 0) {
    text.append(bytes.data(), static_cast<size_t>(file.gcount()));
    if (text.size() > size_bytes_max) {
      return Status::InvalidArgument(path + " has more than " + std::to_string(size_bytes_max) +
                                     " bytes");
    }
  }
  if (file.bad()) return Status::IoError("cannot read " + path);
  return text;
}

}  // namespace veduta
