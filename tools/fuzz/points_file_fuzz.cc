// SPDX-License-Identifier: Apache-2.0
// ParsePoints: points.json of `veduta calibrate --points`.
#include "engine/camera/files/points_file.h"
#include "tools/fuzz/fuzz_target.h"

namespace veduta::fuzz {

std::vector<std::string> Seeds() {
  return {
      "{\"width\":1536,\"height\":1024,\"views\":[{\"name\":\"a.jpg\",\"points\":[{\"id\":0,\"x\":"
      "1.0,\"y\":2.0,\"sigma\":0.1},{\"id\":1,\"x\":100.5,\"y\":2e2}]},{\"name\":\"b\",\"width\":"
      "640,\"height\":480,\"points\":[]}]}",
      "{\"width\":4,\"height\":4,\"views\":[{\"points\":[{\"id\":4294967295,\"x\":-1,\"y\":0}]}]}"};
}

}  // namespace veduta::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const auto input = veduta::ParsePoints(veduta::fuzz::Text(data, size));
  if (input.ok())
    veduta::fuzz::Expect(input->views.size() <= veduta::kViewsMax, "views keep to their limit");
  return 0;
}
