// SPDX-License-Identifier: Apache-2.0
// ParsePhotoList: the list of `veduta add --list`, with and without a folder.
#include <algorithm>

#include "cli/photos/photo_list.h"
#include "tools/fuzz/fuzz_target.h"

namespace veduta::fuzz {

std::vector<std::string> Seeds() {
  return {"# photos\na/1.jpg\na/2.jpg\tphone\r\n\n/x/../y/3.jpg\tother\n", "../b c.jpg\n./d.jpg",
          "\t\n"};
}

}  // namespace veduta::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string_view text = veduta::fuzz::Text(data, size);
  const size_t lines = 1 + static_cast<size_t>(std::count(text.begin(), text.end(), '\n'));
  for (const char* folder : {"", "photos"}) {
    const auto photos = veduta::ParsePhotoList(text, folder);
    if (photos.ok())
      veduta::fuzz::Expect(photos->size() <= lines, "a line names one photo at most");
  }
  return 0;
}
