// SPDX-License-Identifier: Apache-2.0
// Goal: commands of the owner that are stopped, as by a daemon that ends, say so and leave nothing.
// Method: a small street, and commands that are stopped before they begin.
#include "cli/service/owner_commands.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

HttpRequest Command(PathArguments path, const std::string& body) {
  HttpRequest request;
  request.method = "POST";
  request.path = std::move(path);
  request.is_of_owner = true;
  request.body.assign(body.begin(), body.end());
  return request;
}

TEST(OwnerCommands, ThatAreStoppedSaySo) {
  const TemporaryFolder folder;
  const std::string copy = folder / "copy";
  City city;
  city.Add(Walk(6, 0.9, 4));
  DenseKeeper keeper(&city.engine(), {}, {});
  OwnerCommands commands(&city.engine(), &keeper, nullptr, "");
  const HttpRequest copies = Command({"v1", "copies"}, "{\"folder\": \"" + copy + "\"}");
  const HttpRequest train = Command({"v1", "vocabulary", "train"}, "{}");
  commands.Stop();
  for (const HttpRequest& request : {copies, train}) {
    const HttpAnswer answer = commands.Answer(request);
    EXPECT_EQ(answer.code, 503u) << answer.body;
    EXPECT_NE(answer.body.find("stopped"), std::string::npos) << answer.body;
  }
  EXPECT_FALSE(std::filesystem::exists(copy));
  EXPECT_EQ(city.engine().Ask().Status()->vocabulary_generation, 0u);
  OwnerCommands others(&city.engine(), &keeper, nullptr, "");
  EXPECT_EQ(others.Answer(copies).code, 200u);
  EXPECT_EQ(others.Answer(train).code, 200u);
}

}  // namespace
}  // namespace veduta
