// SPDX-License-Identifier: Apache-2.0
// Goal: a request comes to its route, or is told that there is none, that the method is wrong, or
//   that a parameter is not known.
// Method: requests as the connections hand them over. What the routes answer is compared with the
//   command line by serve_test.py.
#include "cli/service/city_routes.h"

#include <gtest/gtest.h>

namespace veduta {
namespace {

std::variant<RouteMatch, HttpAnswer> Find(const std::string& method, std::vector<std::string> path,
                                          std::map<std::string, std::string> query = {}) {
  HttpRequest request;
  request.method = method;
  request.path = std::move(path);
  request.query = std::move(query);
  return FindRoute(request);
}

TEST(CityRoutes, OpenPartsOfAPathAreArguments) {
  const auto pose = Find("GET", {"v1", "photos", "anna/1.jpg", "pose"});
  ASSERT_TRUE(std::holds_alternative<RouteMatch>(pose));
  EXPECT_EQ(std::get<RouteMatch>(pose).arguments, PathArguments{"anna/1.jpg"});
  EXPECT_TRUE(std::get<RouteMatch>(pose).route->is_of_snapshot);
  const auto status = Find("GET", {"v1", "status"});
  ASSERT_TRUE(std::holds_alternative<RouteMatch>(status));
  EXPECT_TRUE(std::get<RouteMatch>(status).arguments.empty());
  EXPECT_FALSE(std::get<RouteMatch>(status).route->is_of_snapshot)
      << "it has what this process has read and written";
}

TEST(CityRoutes, WhereNothingIsIs404) {
  for (const std::vector<std::string>& path :
       std::vector<std::vector<std::string>>{{"v1"},
                                             {"page.html"},
                                             {"v2", "status"},
                                             {"v1", "status", "more"},
                                             {"v1", "photos", "a", "b", "pose"}}) {
    const auto found = Find("GET", path);
    ASSERT_TRUE(std::holds_alternative<HttpAnswer>(found));
    EXPECT_EQ(std::get<HttpAnswer>(found).code, 404u);
  }
}

TEST(CityRoutes, WhatChangesTheCityForOthersTakesACurator) {
  for (const char* what : {"removals", "forbidden", "allowed"}) {
    const auto found = Find("POST", {"v1", what});
    ASSERT_TRUE(std::holds_alternative<RouteMatch>(found));
    EXPECT_TRUE(std::get<RouteMatch>(found).route->is_for_owner);
    EXPECT_EQ(std::get<RouteMatch>(found).route->role, Role::kCurator);
  }
}

TEST(CityRoutes, AnotherMethodIsNamed) {
  const auto found = Find("PUT", {"v1", "cameras"});
  ASSERT_TRUE(std::holds_alternative<HttpAnswer>(found));
  const HttpAnswer& answer = std::get<HttpAnswer>(found);
  EXPECT_EQ(answer.code, 405u);
  EXPECT_EQ(answer.headers.at(0), std::make_pair(std::string("Allow"), std::string("GET, POST")));
}

TEST(CityRoutes, AParameterThatNobodyReadsIsRefused) {
  EXPECT_TRUE(std::holds_alternative<RouteMatch>(
      Find("GET", {"v1", "journal"}, {{"from", "1"}, {"count", "2"}})));
  const auto found = Find("GET", {"v1", "journal"}, {{"form", "1"}});
  ASSERT_TRUE(std::holds_alternative<HttpAnswer>(found));
  EXPECT_EQ(std::get<HttpAnswer>(found).code, 400u);
  EXPECT_NE(std::get<HttpAnswer>(found).body.find("'form'"), std::string::npos);
}

}  // namespace
}  // namespace veduta
