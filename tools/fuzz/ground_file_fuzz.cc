// SPDX-License-Identifier: Apache-2.0
// ParseGroundPoints: the file of `veduta georeference --gcp`.
#include <algorithm>
#include <cmath>

#include "engine/earth/ground_file.h"
#include "tools/fuzz/fuzz_target.h"

namespace veduta::fuzz {

std::vector<std::string> Seeds() {
  return {"EPSG:4326\n15.44 47.07 350 1024.5 7 IMG_1.jpg corner\n",
          "WGS84 UTM 33N\n# points\n500000\t5213000.5\t353.2\t30\t40\tmy photo.jpg\tgcp01\r\n",
          "+proj=utm +zone=33 +datum=WGS84\n1 2 3 4 5 a.jpg\n\n"};
}

}  // namespace veduta::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using veduta::fuzz::Expect;
  const std::string_view text = veduta::fuzz::Text(data, size);
  const auto file = veduta::ParseGroundPoints(text);
  if (!file.ok()) return 0;
  Expect(file->lines.size() <= 1 + static_cast<size_t>(std::count(text.begin(), text.end(), '\n')),
         "a line names one point at most");
  for (const veduta::GroundLine& line : file->lines) {
    Expect(std::abs(line.position.latitude_deg) <= 90 &&
               std::abs(line.position.longitude_deg) <= 180 &&
               std::isfinite(line.position.height_m),
           "a point that is read lies on the earth");
    Expect(!line.point.empty() && !line.photo.empty(), "a point and its photo have names");
  }
  Expect(!file->coordinates.name.empty() && file->coordinates.accuracy_m.value_or(0) >= 0,
         "what the coordinates are is told");
  return 0;
}
