// SPDX-License-Identifier: Apache-2.0
#pragma once
// The web page that the daemon serves, as it was built from TypeScript.

#include <span>
#include <string_view>

namespace veduta {

struct PageFile {
  std::string_view name;          // "index.html"
  std::string_view content_type;  // with its charset
  std::string_view etag;          // of the bytes, quoted
  std::string_view bytes;
};

// All files of the page; they ask for nothing from any other host. Thread-safe.
std::span<const PageFile> PageFiles();

}  // namespace veduta
