// SPDX-License-Identifier: Apache-2.0
// ParseStacQuery: the body of a search, with its box or geometry and its times.
#include "cli/service/stac_query.h"
#include "tools/fuzz/fuzz_target.h"

namespace veduta::fuzz {

std::vector<std::string> Seeds() {
  return {R"({"limit":5,"bbox":[170,-10,0,-170,10,9],"datetime":"1970-01-01T00:00:00.5Z/..",)"
          R"("ids":["1","22"],"collections":["photos"],"token":"7"})",
          R"({"intersects":{"type":"Polygon","coordinates":[[[0,0],[4,0],[4,4],[0,0]]]}})",
          R"({"intersects":{"type":"GeometryCollection","geometries":[{"type":"MultiPoint",)"
          R"("coordinates":[[1,2],[3,4,5]]},{"type":"LineString","coordinates":[[0,0],[1,1]]}]}})"};
}

}  // namespace veduta::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using veduta::fuzz::Expect;
  veduta::HttpRequest request;
  request.method = "POST";
  request.body.assign(data, data + size);
  const auto members = veduta::StacMembers(request);
  if (!members.ok()) return 0;
  const auto search = veduta::ParseStacQuery(*members);
  if (!search.ok()) return 0;
  Expect(search->count_max >= 1 && search->count_max <= veduta::kStacItemsMax,
         "a page has as many items as it may");
  if (search->is_there) search->is_there({2, 1, 0});
  const auto link = veduta::NextStacLink(request, *members, "", veduta::ImageId(9));
  const auto next = veduta::ParseStacQuery(link["body"]);
  Expect(next.ok() && next->after == veduta::ImageId(9), "the next page can be asked for");
  return 0;
}
