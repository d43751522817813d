// SPDX-License-Identifier: Apache-2.0
// Goal: the document has every route, says something of each, and describes nothing that is not
//   there; whom a route answers is what the gatekeeper goes by.
// Method: the document of the real routes against their table; serve_test.py asks a daemon for it.
#include "cli/service/openapi.h"

#include <gtest/gtest.h>

#include <set>

#include "cli/service/city_routes.h"

namespace veduta {
namespace {

TEST(OpenApi, SaysSomethingOfEveryRoute) {
  const Json document = OpenApi(ListRoutes());
  EXPECT_EQ(document["openapi"], "3.0.3");
  std::set<std::string> ids;
  size_t operations = 0;
  for (const auto& [path, methods] : document["paths"].items()) {
    for (const auto& [method, operation] : methods.items()) {
      ++operations;
      EXPECT_NE(operation["summary"], "") << method << " " << path;
      EXPECT_TRUE(ids.insert(operation["operationId"]).second) << operation["operationId"];
      EXPECT_TRUE(operation["responses"].contains("default")) << path;
      // Each part of the path in braces is a parameter.
      size_t open = 0;
      for (const char c : path) open += c == '{';
      size_t in_path = 0;
      for (const Json& parameter : operation.value("parameters", Json::array()))
        in_path += parameter["in"] == "path";
      EXPECT_EQ(in_path, open) << path;
    }
  }
  EXPECT_EQ(operations, ListRoutes().size());
}

TEST(OpenApi, TellsWhomARouteAnswers) {
  const Json document = OpenApi(ListRoutes());
  const Json& paths = document["paths"];
  EXPECT_TRUE(paths["/healthz"]["get"]["security"].empty());
  EXPECT_EQ(paths["/v1/status"]["get"]["security"].size(), 1u);
  const std::string removal = paths["/v1/removals"]["post"]["description"];
  EXPECT_NE(removal.find("curator"), std::string::npos);
  EXPECT_TRUE(paths["/v1/photos"]["post"]["requestBody"]["content"].contains("image/*"));
  EXPECT_TRUE(paths["/v1/photos"].contains("get"));
}

TEST(OpenApi, TellsEverySuccessAndTheHeadersThatAreRead) {
  const Json document = OpenApi(ListRoutes());
  const Json& paths = document["paths"];
  const auto has_header = [](const Json& operation, const std::string& name) {
    for (const Json& parameter : operation.value("parameters", Json::array()))
      if (parameter["in"] == "header" && parameter["name"] == name) return true;
    return false;
  };
  const Json& send = paths["/v1/photos"]["post"];
  for (const char* code : {"200", "201", "202"})
    EXPECT_TRUE(send["responses"][code]["content"].contains("application/json")) << code;
  EXPECT_TRUE(has_header(send, "Prefer"));
  const Json& list = paths["/v1/photos"]["get"];
  EXPECT_TRUE(list["responses"].contains("304"));
  EXPECT_FALSE(list["responses"].contains("206"));
  EXPECT_TRUE(has_header(list, "If-None-Match"));
  const Json& points = paths["/v1/reconstructions/{reconstruction}/points"]["get"];
  EXPECT_TRUE(points["responses"]["206"]["content"].contains("application/octet-stream"));
  EXPECT_TRUE(has_header(points, "Range"));
  EXPECT_FALSE(paths["/v1/status"]["get"]["responses"].contains("304"));
  EXPECT_TRUE(has_header(paths["/v1/events"]["get"], "Last-Event-ID"));
  EXPECT_FALSE(has_header(paths["/v1/events"]["get"], "Range"));
  for (const char* name : {"Tus-Resumable", "Upload-Length", "Upload-Metadata", "Upload-Checksum"})
    EXPECT_TRUE(has_header(paths["/v1/tus"]["post"], name)) << name;
  EXPECT_TRUE(has_header(paths["/v1/tus/{tus}"]["patch"], "Upload-Offset"));
}

TEST(OpenApi, OpenPartsAreCalledByWhatIsBeforeThem) {
  const CityRoute route = {"GET", {"v1", "photos", "*", "pose"}, {}, nullptr};
  EXPECT_EQ(PathTemplate(route), "/v1/photos/{photo}/pose");
  const CityRoute unknown = {"GET", {"v1", "nothing"}, {}, nullptr};
  EXPECT_EQ(OpenApi({&unknown, 1})["paths"]["/v1/nothing"]["get"]["summary"], "");
}

}  // namespace
}  // namespace veduta
