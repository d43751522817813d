// SPDX-License-Identifier: Apache-2.0
// Goal: every role may do what its table says, and nothing else; without tokens the owner's routes
//   are the owner's; nobody sends photos under another's name.
// Method: every role against every route that there is, by requests as the connections hand them
//   over; the table is written down here once more.
#include "cli/service/gatekeeper.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "cli/service/city_routes.h"
#include "tests/storage/samples.h"

namespace veduta {
namespace {

struct Asked {
  const char* method;
  std::vector<std::string> path;
  int role;  // the least that may: 0 anybody, 1 viewer, 2 contributor, 3 curator, 4 admin, 5 nobody
  bool is_for_owner = false;
};

const std::vector<Asked>& RoutesOfRoles() {
  static const std::vector<Asked> kAll = {
      {"GET", {}, 0},
      {"GET", {"page.js"}, 0},
      {"GET", {"page.css"}, 0},
      {"GET", {"healthz"}, 0},
      {"GET", {"readyz"}, 0},
      {"GET", {"v1", "openapi.json"}, 0},
      {"GET", {"metrics"}, 1},
      {"GET", {"v1", "events"}, 1},
      {"GET", {"v1", "photos"}, 1},
      {"POST", {"v1", "photos"}, 2},
      {"GET", {"v1", "dense"}, 1},
      {"POST", {"v1", "dense", "pause"}, 3},
      {"POST", {"v1", "dense", "resume"}, 3},
      {"GET", {"v1", "uploads"}, 2},
      {"GET", {"v1", "uploads", "1"}, 2},
      {"OPTIONS", {"v1", "tus"}, 0},
      {"POST", {"v1", "tus"}, 2},
      {"GET", {"v1", "tus", "1"}, 2},
      {"PATCH", {"v1", "tus", "1"}, 2},
      {"DELETE", {"v1", "tus", "1"}, 2},
      {"GET", {"v1", "contributions"}, 1},
      {"POST", {"v1", "contributions"}, 2},
      {"GET", {"v1", "contributions", "1"}, 1},
      {"GET", {"v1", "contributions", "1", "photos"}, 1},
      {"POST", {"v1", "contributions", "1", "close"}, 2},
      {"DELETE", {"v1", "contributions", "1"}, 3, true},
      {"GET", {"v1", "status"}, 1},
      {"GET", {"v1", "cameras"}, 1},
      {"POST", {"v1", "cameras"}, 3},
      {"GET", {"v1", "cameras", "c"}, 1},
      {"GET", {"v1", "photos", "a"}, 1},
      {"GET", {"v1", "photos", "a", "pose"}, 1},
      {"GET", {"v1", "photos", "a", "geopose"}, 1},
      {"GET", {"v1", "photos", "a", "uncertainty"}, 1},
      {"GET", {"v1", "photos", "a", "neighbors"}, 1},
      {"GET", {"v1", "photos", "a", "thumbnail"}, 1},
      {"GET", {"v1", "photos", "a", "file"}, 3},
      {"GET", {"v1", "photos", "a", "original"}, 4, true},
      {"POST", {"v1", "candidates"}, 1},
      {"POST", {"v1", "localize"}, 1},
      {"GET", {"v1", "reconstructions"}, 1},
      {"GET", {"v1", "reconstructions", "1"}, 1},
      {"GET", {"v1", "reconstructions", "1", "points"}, 1},
      {"GET", {"v1", "reconstructions", "1", "surface", "tileset.json"}, 1},
      {"GET", {"v1", "reconstructions", "1", "surface", "tiles", "a.glb"}, 1},
      {"GET", {"v1", "georeference"}, 1},
      {"POST", {"v1", "georeference"}, 3, true},
      {"GET", {"v1", "hypotheses"}, 1},
      {"GET", {"v1", "journal"}, 1},
      {"POST", {"v1", "removals"}, 3, true},
      {"POST", {"v1", "forbidden"}, 3, true},
      {"POST", {"v1", "allowed"}, 3, true},
      {"GET", {"v1", "tokens"}, 4, true},
      {"POST", {"v1", "tokens"}, 4, true},
      {"POST", {"v1", "tokens", "1", "revoke"}, 4, true}};
  return kAll;
}

const std::vector<Asked>& RoutesOfModeration() {
  static const std::vector<Asked> kAll = {{"GET", {"v1", "me"}, 1},
                                          {"POST", {"v1", "photos", "a", "report"}, 1},
                                          {"GET", {"v1", "reports"}, 3, true},
                                          {"POST", {"v1", "reports", "1", "dismiss"}, 3, true},
                                          {"GET", {"v1", "hidden"}, 3, true},
                                          {"POST", {"v1", "hidden"}, 3, true},
                                          {"POST", {"v1", "shown"}, 3, true}};
  return kAll;
}

const std::vector<Asked>& RoutesOfStacAndLinks() {
  static const std::vector<Asked> kAll = {
      {"GET", {"v1", "stac"}, 1},
      {"GET", {"v1", "stac", "conformance"}, 1},
      {"GET", {"v1", "stac", "collections"}, 1},
      {"GET", {"v1", "stac", "collections", "photos"}, 1},
      {"GET", {"v1", "stac", "collections", "photos", "items"}, 1},
      {"GET", {"v1", "stac", "collections", "photos", "items", "1"}, 1},
      {"GET", {"v1", "stac", "search"}, 1},
      {"POST", {"v1", "stac", "search"}, 1},
      {"GET", {"v1", "links"}, 3, true},
      {"POST", {"v1", "links"}, 3, true},
      {"POST", {"v1", "links", "1", "revoke"}, 3, true}};
  return kAll;
}

std::vector<Asked> AllRoutes() {
  std::vector<Asked> all = RoutesOfRoles();
  for (const Asked& asked : RoutesOfModeration()) all.push_back(asked);
  for (const Asked& asked : RoutesOfStacAndLinks()) all.push_back(asked);
  for (const Asked& asked : {Asked{"POST", {"v1", "settle"}, 5, true},
                             {"POST", {"v1", "models"}, 5, true},
                             {"POST", {"v1", "cameras", "calibrate"}, 5, true},
                             {"POST", {"v1", "densify"}, 5, true},
                             {"POST", {"v1", "vocabulary", "train"}, 5, true},
                             {"POST", {"v1", "vocabulary", "import"}, 5, true},
                             {"POST", {"v1", "backups"}, 5, true},
                             {"POST", {"v1", "copies"}, 5, true}})
    all.push_back(asked);
  return all;
}

class GatekeeperTest : public testing::Test {
 protected:
  GatekeeperTest() {
    EngineOptions options;
    options.create = true;
    options.sync = false;
    options.thread_count = 1;
    auto opened = Engine::Open(folder_ / "db", options);
    EXPECT_OK(opened);
    engine_ = std::move(*opened);
    EXPECT_OK(gatekeeper_.Look(engine_->Ask()));
  }

  NewToken Make(const std::string& name, Role role) {
    TokenRequest request;
    request.name = name;
    request.role = role;
    const auto made = engine_->CreateToken(request);
    EXPECT_OK(made);
    EXPECT_OK(gatekeeper_.Look(engine_->Ask()));
    return *made;
  }

  // The code of the refusal; 0 where it is let in.
  uint32_t Ask(const Asked& asked, const std::string& token, HttpRequest* request) {
    request->method = asked.method;
    request->path = asked.path;
    request->token = token;
    auto found = FindRoute(*request);
    EXPECT_TRUE(std::holds_alternative<RouteMatch>(found)) << asked.path.back();
    const auto refusal = gatekeeper_.Refuse(*engine_, *std::get<RouteMatch>(found).route, request);
    return refusal ? refusal->code : 0;
  }
  uint32_t Ask(const Asked& asked, const std::string& token = "") {
    HttpRequest request;
    return Ask(asked, token, &request);
  }

  TemporaryFolder folder_;
  std::unique_ptr<Engine> engine_;
  Gatekeeper gatekeeper_;
};

TEST_F(GatekeeperTest, NobodyIsAskedBeforeThereIsAToken) {
  EXPECT_FALSE(gatekeeper_.asks_for_tokens());
  EXPECT_FALSE(gatekeeper_.has_tokens());
  for (const Asked& asked : AllRoutes()) {
    EXPECT_EQ(Ask(asked), asked.is_for_owner ? 403u : 0u) << asked.path.back();
    HttpRequest request;
    request.is_of_owner = true;
    EXPECT_EQ(Ask(asked, "", &request), 0u) << asked.path.back();
  }
}

TEST_F(GatekeeperTest, WhatWasNotReadIsReadByTheNextRequest) {
  const Asked status = {"GET", {"v1", "status"}, 1};
  Gatekeeper unread;
  EXPECT_TRUE(unread.asks_for_tokens());
  EXPECT_FALSE(unread.has_tokens()) << "nobody knows by now";
  HttpRequest request;
  request.method = status.method;
  request.path = status.path;
  const auto found = FindRoute(request);
  const CityRoute& route = *std::get<RouteMatch>(found).route;
  EXPECT_FALSE(unread.Refuse(*engine_, route, &request));
  EXPECT_FALSE(unread.asks_for_tokens());
  Make("v", Role::kViewer);
  Gatekeeper unread_with_tokens;
  const auto refusal = unread_with_tokens.Refuse(*engine_, route, &request);
  ASSERT_TRUE(refusal);
  EXPECT_EQ(refusal->code, 401u);
}

TEST_F(GatekeeperTest, EveryRoleAgainstEveryRoute) {
  ASSERT_EQ(AllRoutes().size(), ListRoutes().size()) << "a route is not in this table";
  const std::string tokens[] = {"", Make("v", Role::kViewer).text,
                                Make("c", Role::kContributor).text, Make("k", Role::kCurator).text,
                                Make("a", Role::kAdmin).text};
  EXPECT_TRUE(gatekeeper_.asks_for_tokens());
  EXPECT_TRUE(gatekeeper_.has_tokens());
  for (const Asked& asked : AllRoutes()) {
    for (int role = 0; role <= 4; ++role) {
      const uint32_t wanted = role >= asked.role ? 0 : role == 0 ? 401 : 403;
      EXPECT_EQ(Ask(asked, tokens[role]), wanted)
          << asked.method << " " << asked.path.back() << " by role " << role;
    }
    EXPECT_EQ(Ask(asked, "veduta-1-wrong"), asked.role == 0 ? 0u : 401u);
    HttpRequest request;
    request.is_of_owner = true;
    EXPECT_EQ(Ask(asked, "", &request), 0u);
  }
}

TEST_F(GatekeeperTest, ARevokedTokenIsNoneAndTheDoorStaysShut) {
  const NewToken token = Make("v", Role::kViewer);
  const Asked status = {"GET", {"v1", "status"}, 1};
  EXPECT_EQ(Ask(status, token.text), 0u);
  ASSERT_OK(engine_->RevokeToken(token.number, "owner"));
  EXPECT_OK(gatekeeper_.Look(engine_->Ask()));
  EXPECT_EQ(Ask(status, token.text), 401u);
  EXPECT_EQ(Ask(status), 401u);
}

TEST_F(GatekeeperTest, WhatIsHiddenIsForTheOwnerAndCurators) {
  const Asked photo = {"GET", {"v1", "photos", "a"}, 1};
  HttpRequest request;
  EXPECT_EQ(Ask(photo, "", &request), 0u) << "before there is a token";
  EXPECT_FALSE(request.sight.sees_hidden);
  for (const auto& [role, sees] : {std::pair(Role::kViewer, false),
                                   {Role::kContributor, false},
                                   {Role::kCurator, true},
                                   {Role::kAdmin, true}}) {
    EXPECT_EQ(Ask(photo, Make("x", role).text, &request), 0u);
    EXPECT_EQ(request.sight.sees_hidden, sees) << RoleWord(role);
  }
  request.is_of_owner = true;
  EXPECT_EQ(Ask(photo, "", &request), 0u);
  EXPECT_TRUE(request.sight.sees_hidden);
}

TEST_F(GatekeeperTest, ALinkForAPartIsAskedForPartsAlone) {
  const auto opened = engine_->OpenContribution({"anna", "", "", "anna"});
  ASSERT_OK(opened);
  TokenRequest wanted;
  wanted.name = "a friend";
  wanted.is_link = true;
  wanted.expires_unix_s = 4'000'000'000;
  wanted.contribution = 9;
  EXPECT_EQ(engine_->CreateToken(wanted).status().code(), StatusCode::kNotFound);
  wanted.contribution = *opened;
  wanted.reconstruction = 1;
  EXPECT_EQ(engine_->CreateToken(wanted).status().code(), StatusCode::kInvalidArgument);
  wanted.reconstruction = 0;
  const auto link = engine_->CreateToken(wanted);
  ASSERT_OK(link);
  EXPECT_OK(gatekeeper_.Look(engine_->Ask()));
  const std::set<std::string> kOfParts = {
      "me",      "status",  "photos",     "reconstructions", "stac", "events", "contributions",
      "journal", "cameras", "hypotheses", "georeference"};
  size_t open = 0;
  for (const Asked& asked : AllRoutes()) {
    HttpRequest request;
    const uint32_t code = Ask(asked, link->text, &request);
    const std::string& what = asked.path.size() > 1 ? asked.path[1] : "";
    const bool is_of_parts = asked.role == 1 && kOfParts.contains(what);
    EXPECT_EQ(code, asked.role == 0 || is_of_parts ? 0u : 403u) << asked.path.back();
    if (!is_of_parts) continue;
    ++open;
    EXPECT_EQ(request.sight.contribution, *opened);
    EXPECT_FALSE(request.sight.sees_hidden);
  }
  EXPECT_GT(open, 20u);
  wanted.is_link = false;
  EXPECT_EQ(engine_->CreateToken(wanted).status().code(), StatusCode::kInvalidArgument);
}

TEST_F(GatekeeperTest, PhotosAreSentUnderTheTokensName) {
  const NewToken anna = Make("anna", Role::kContributor), kai = Make("kai", Role::kCurator);
  const Asked photo = {"POST", {"v1", "photos"}, 2};
  HttpRequest request;
  EXPECT_EQ(Ask(photo, anna.text, &request), 0u);
  EXPECT_EQ(request.who, "anna");
  request.query["contributor"] = "anna";
  EXPECT_EQ(Ask(photo, anna.text, &request), 0u);
  request.query["contributor"] = "bela";
  EXPECT_EQ(Ask(photo, anna.text, &request), 403u);
  EXPECT_EQ(Ask(photo, kai.text, &request), 0u) << "a curator may send for others";
}

TEST_F(GatekeeperTest, ARefusalSaysWhatToDo) {
  Make("v", Role::kViewer);
  HttpRequest request;
  request.method = "GET";
  request.path = {"v1", "status"};
  const auto found = FindRoute(request);
  const auto refusal = gatekeeper_.Refuse(*engine_, *std::get<RouteMatch>(found).route, &request);
  ASSERT_TRUE(refusal);
  EXPECT_EQ(refusal->headers.at(0).first, "WWW-Authenticate");
  EXPECT_NE(refusal->body.find("Authorization: Bearer"), std::string::npos);
}

}  // namespace
}  // namespace veduta
