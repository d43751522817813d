// SPDX-License-Identifier: Apache-2.0
// Goal: what computes is told from what does not, what writes, removals and commands from both, and
//   those who ask from each other.
// Method: the routes that there are.
#include "cli/service/asked_work.h"

#include <gtest/gtest.h>

#include <set>
#include <variant>

#include "cli/service/city_routes.h"

namespace veduta {
namespace {

std::set<std::string> RoutesOfKind(WorkKind kind) {
  std::set<std::string> routes;
  for (const CityRoute& route : ListRoutes()) {
    if (route.is_for_owner_alone || route.is_quick || WorkKindOf(route) != kind) continue;
    std::string path = route.method;
    for (const std::string& part : route.path) path += "/" + part;
    routes.insert(path);
  }
  return routes;
}

TEST(AskedWork, WhatComputesIsLong) {
  EXPECT_EQ(RoutesOfKind(WorkKind::kLong),
            (std::set<std::string>{"POST/v1/localize", "POST/v1/candidates",
                                   "GET/v1/photos/*/uncertainty", "GET/v1/photos/*/thumbnail",
                                   "GET/v1/reconstructions/*/points",
                                   "GET/v1/reconstructions/*/surface/tileset.json",
                                   "GET/v1/reconstructions/*/surface/tiles/*"}));
}

TEST(AskedWork, GeoreferencingIsACommandAsTheOwnersAre) {
  EXPECT_EQ(RoutesOfKind(WorkKind::kCommand), std::set<std::string>{"POST/v1/georeference"});
  for (const CityRoute& route : ListRoutes()) {
    if (route.is_for_owner_alone) {
      EXPECT_EQ(WorkKindOf(route), WorkKind::kCommand) << route.path.back();
    }
  }
}

TEST(AskedWork, RemovalsAreOfAKindOfTheirOwn) {
  EXPECT_EQ(RoutesOfKind(WorkKind::kRemoval),
            (std::set<std::string>{"POST/v1/removals", "DELETE/v1/contributions/*"}));
}

TEST(AskedWork, WhatWritesIsAChangeUnlessItIsAPhoto) {
  EXPECT_EQ(RoutesOfKind(WorkKind::kChange),
            (std::set<std::string>{"POST/v1/allowed", "POST/v1/cameras", "POST/v1/contributions",
                                   "POST/v1/contributions/*/close", "POST/v1/forbidden",
                                   "POST/v1/hidden", "POST/v1/links", "POST/v1/links/*/revoke",
                                   "POST/v1/photos/*/report", "POST/v1/reports/*/dismiss",
                                   "POST/v1/shown", "POST/v1/tokens", "POST/v1/tokens/*/revoke"}));
  for (const std::string& route : RoutesOfKind(WorkKind::kShort)) {
    const std::set<std::string> others = {
        "POST/v1/photos", "POST/v1/dense/pause", "POST/v1/tus",        "POST/v1/dense/resume",
        "PATCH/v1/tus/*", "DELETE/v1/tus/*",     "POST/v1/stac/search"};
    EXPECT_TRUE(route.starts_with("GET") || others.contains(route)) << route;
  }
}

TEST(AskedWork, TurnsAreOfTokensOrElseOfAddresses) {
  HttpRequest request;
  request.address = "192.0.2.1";
  request.token = "none";  // which nobody has found good
  EXPECT_EQ(AskerOf(request), "192.0.2.1");
  request.address = "2001:db8::1:2:3:4";
  EXPECT_EQ(AskerOf(request), "2001:db8::/64") << "one network is one sender";
  request.token = "veduta-1-x";
  request.token_number = 1;
  EXPECT_EQ(AskerOf(request), "token 1");
  request.token = "veduta-01-x";
  EXPECT_EQ(AskerOf(request), "token 1") << "however it is spelled";
  request.is_of_owner = true;
  EXPECT_EQ(AskerOf(request), "owner");
  EXPECT_EQ(HolderOf(request), "") << "the owner's are not counted";
  request = {};
  request.address = "127.0.0.1";
  EXPECT_EQ(HolderOf(request), "") << "by a proxy all come from this machine";
  request.address = "192.0.2.1";
  EXPECT_EQ(HolderOf(request), "192.0.2.1");
  request.token_number = 7;
  EXPECT_EQ(HolderOf(request), "token 7");
}

}  // namespace
}  // namespace veduta
