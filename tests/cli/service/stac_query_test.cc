// SPDX-License-Identifier: Apache-2.0
// Goal: a search is read the same from an address and from a body, each wrong member is named, and
//   the link to the next page asks for the same.
// Method: requests as the connections hand them over.
#include "cli/service/stac_query.h"

#include <gtest/gtest.h>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

HttpRequest Get(std::map<std::string, std::string> query) {
  HttpRequest request;
  request.method = "GET";
  request.query = std::move(query);
  return request;
}

HttpRequest Post(const std::string& body) {
  HttpRequest request;
  request.method = "POST";
  request.body.assign(body.begin(), body.end());
  return request;
}

Result<PhotoSearch> Read(const HttpRequest& request) {
  VEDUTA_ASSIGN_OR_RETURN(const Json members, StacMembers(request));
  return ParseStacQuery(members);
}

using Ids = std::vector<ImageId>;

TEST(StacQuery, IsTheSameFromAnAddressAndFromABody) {
  for (const auto& request :
       {Get({{"limit", "7"},
             {"bbox", "1,2,3.5,4"},
             {"datetime", "1970-01-01T00:00:09Z/.."},
             {"ids", "5,6,x"},
             {"collections", "photos"},
             {"token", "4"}}),
        Post(R"({"limit":7,"bbox":[1,2,3.5,4],"datetime":"1970-01-01T00:00:09Z/..",)"
             R"("ids":["5","6","x"],"collections":["photos"],"token":"4","intersects":null})")}) {
    const auto search = Read(request);
    ASSERT_OK(search);
    EXPECT_EQ(search->count_max, 7u);
    EXPECT_EQ(search->after, ImageId(4));
    EXPECT_EQ(search->taken_from_unix_s, 9);
    EXPECT_FALSE(search->taken_to_unix_s);
    EXPECT_NE(std::ranges::find(search->images, ImageId(6)), search->images.end());
    EXPECT_EQ(std::ranges::find(search->images, ImageId(7)), search->images.end());
    EXPECT_TRUE(search->is_there({3, 2, 0}));
    EXPECT_FALSE(search->is_there({5, 2, 0}));
  }
  const auto within = Read(Get({{"intersects", R"({"type":"Point","coordinates":[1,2]})"}}));
  ASSERT_OK(within);
  EXPECT_TRUE(within->is_there({2, 1, 0}));
}

TEST(StacQuery, NothingMeansAll) {
  for (const auto& request : {Get({}), Post("{}"), Post(R"({"ids":[],"collections":[]})")}) {
    const auto search = Read(request);
    ASSERT_OK(search);
    EXPECT_EQ(search->count_max, kStacItemsDefault);
    EXPECT_TRUE(search->images.empty());
    EXPECT_FALSE(search->is_there);
  }
  EXPECT_EQ(Read(Get({{"limit", "100000"}}))->count_max, kStacItemsMax);
}

TEST(StacQuery, AnotherCollectionHasNoPhotos) {
  const auto search = Read(Post(R"({"ids":["1"],"collections":["scenes"]})"));
  ASSERT_OK(search);
  EXPECT_EQ(search->images, Ids{ImageId(UINT32_MAX)});  // which is no photo's number
}

TEST(StacQuery, WrongMembersAreNamed) {
  const auto refused = [](const HttpRequest& request, const std::string& word) {
    const auto search = Read(request);
    EXPECT_EQ(search.status().code(), StatusCode::kInvalidArgument) << word;
    EXPECT_NE(search.status().message().find(word), std::string::npos) << search.status().message();
  };
  refused(Get({{"limit", "0"}}), "limit");
  refused(Get({{"limit", "ten"}}), "limit");
  refused(Get({{"bbox", "1,2,3"}}), "bbox");
  refused(Get({{"bbox", "1,2,3,4],[5"}}), "bbox");
  refused(Get({{"datetime", "yesterday"}}), "datetime");
  refused(Get({{"token", "-1"}}), "token");
  refused(Get({{"token", "4294967295"}}), "token");
  refused(Get({{"intersects", "{"}}), "intersects");
  refused(Post("[]"), "object");
  refused(Post("{"), "object");
  refused(Post(R"({"limit":-3})"), "limit");
  refused(Post(R"({"limit":1.5})"), "limit");
  refused(Post(R"({"ids":"1"})"), "ids");
  refused(Post(R"({"ids":[1]})"), "ids");
  refused(Post(R"({"datetime":7})"), "datetime");
  refused(Post(R"({"sortby":[]})"), "sortby");
  refused(Post(R"({"bbox":[0,0,1,1],"intersects":{"type":"Point","coordinates":[0,0]}})"),
          "intersects");
  refused(Post(R"({"limit":1,"ids":[")" + std::string(70'000, '1') + R"("]})"), "bytes");
}

TEST(StacQuery, NestsNoDeeperThanOtherBodies) {
  const auto nested = [](size_t depth) {
    return std::string(depth, '[') + "0" + std::string(depth, ']');
  };
  // The body itself is one of the objects.
  EXPECT_OK(StacMembers(Post(R"({"ids":)" + nested(15) + "}")));
  EXPECT_OK(StacMembers(Get({{"intersects", nested(16)}})));
  for (const size_t depth : {17u, 1'000u, 30'000u}) {
    for (const auto& request :
         {Post(R"({"ids":)" + nested(depth) + "}"), Get({{"intersects", nested(depth)}})}) {
      const Status deep = StacMembers(request).status();
      EXPECT_EQ(deep.code(), StatusCode::kInvalidArgument) << request.method << depth;
      EXPECT_NE(deep.message().find("in each other"), std::string::npos) << deep.message();
    }
  }
}

TEST(StacQuery, TheNextPageAsksForTheSame) {
  HttpRequest get = Get({{"bbox", "1,2,3,4"}, {"datetime", "../1970-01-01T00:00:00+01:00"}});
  Json link = NextStacLink(get, *StacMembers(get), "http://h/s", ImageId(9));
  EXPECT_EQ(link["rel"], "next");
  EXPECT_EQ(link["href"],
            "http://h/s?token=9&bbox=1,2,3,4&datetime=..%2F1970-01-01T00%3A00%3A00%2B01%3A00");
  const HttpRequest post = Post(R"({"limit":2,"token":"3"})");
  link = NextStacLink(post, *StacMembers(post), "http://h/s", ImageId(9));
  EXPECT_EQ(link["method"], "POST");
  EXPECT_EQ(link["body"], Json::parse(R"({"limit":2,"token":"9"})"));
}

}  // namespace
}  // namespace veduta
