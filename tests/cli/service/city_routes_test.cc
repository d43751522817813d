// SPDX-License-Identifier: Apache-2.0
// Goal: a request comes to its route, or is told that there is none, that the method is wrong, or
//   that a parameter is not known.
//   Who sees a part of the city is told of the reconstructions of that part alone. No route reads
//   a large body as JSON.
// Method: requests as the connections hand them over; a street of two reconstructions, asked with
//   the sights of links. What the routes answer is compared with the command line by serve_test.py.
#include "cli/service/city_routes.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "cli/service/surface_answers.h"
#include "tests/engine/street_fixture.h"

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

TEST(CityRoutes, WhatIsQuickReadsAFewRecordsWhoeverAsks) {
  std::set<std::string> quick;
  for (const CityRoute& route : ListRoutes()) {
    if (!route.is_quick || !route.is_of_snapshot) continue;
    std::string path = route.method;
    for (const std::string& part : route.path) path += "/" + part;
    quick.insert(path);
  }
  // No cameras: which ones a link for a part of the city shows, all images tell.
  EXPECT_EQ(quick, (std::set<std::string>{"GET/v1/photos/*", "GET/v1/photos/*/pose",
                                          "GET/v1/photos/*/geopose", "GET/v1/photos/*/neighbors"}));
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

TEST(CityRoutes, SurveyedPointsAreSentOrForgotten) {
  City city;
  HttpRequest request;
  request.method = "POST";
  request.path = {"v1", "georeference"};
  const auto ask = [&] {
    const auto found = FindRoute(request);
    return std::get<RouteMatch>(found).route->answer(&city.engine(), request, {}).code;
  };
  EXPECT_EQ(ask(), 400u);
  request.query["forget"] = "no";
  EXPECT_EQ(ask(), 400u);
  request.query["forget"] = "yes";
  EXPECT_EQ(ask(), 200u);
}

TEST(CityRoutes, ABodyOfJsonHasALimitEverywhere) {
  City city;
  std::string body = R"({"a": )" + std::string(5 << 20, '[');
  for (const std::vector<std::string>& path :
       std::vector<std::vector<std::string>>{{"v1", "forbidden"},
                                             {"v1", "allowed"},
                                             {"v1", "cameras"},
                                             {"v1", "contributions"},
                                             {"v1", "links"},
                                             {"v1", "links", "1", "revoke"},
                                             {"v1", "tokens"},
                                             {"v1", "tokens", "1", "revoke"},
                                             {"v1", "hidden"},
                                             {"v1", "shown"},
                                             {"v1", "photos", "a", "report"},
                                             {"v1", "reports", "1", "dismiss"}}) {
    HttpRequest request;
    request.method = "POST";
    request.path = path;
    request.content_type = "application/json";
    request.body.assign(body.begin(), body.end());
    const auto found = FindRoute(request);
    const RouteMatch& match = std::get<RouteMatch>(found);
    EXPECT_EQ(match.route->answer(&city.engine(), request, match.arguments).code, 413u)
        << path.back();
  }
}

// Both ends of a street, which the engine does not believe to be one.
CityOptions Unbelieving() {
  CityOptions options = City::Options(2);
  options.ingest.mapper.doubt.seam_pairs_min = 1000;
  return options;
}

class PartsOfACity : public testing::Test {
 protected:
  PartsOfACity() : city_(Unbelieving()) {
    city_.Add({{6, 90},
               {11, 90},
               {16, 90},
               {8.5, 90},
               {20.5, 90},
               {22, 95},
               {23.5, 85},
               {13.5, 90},
               {18, 90}});
    const auto opened = city_.engine().OpenContribution({"anna", "", "", "anna"});
    EXPECT_OK(opened);
    contribution_ = *opened;
    PhotoSubmission photo = city_.Submit({19.2, 90});
    name_ = photo.photo.name;
    photo.contribution = contribution_;
    const Result<Ticket> ticket = city_.engine().Submit(std::move(photo));
    EXPECT_OK(ticket);
    EXPECT_OK(ticket->Wait());
    const auto image = city_.engine().Ask().Image(name_);
    EXPECT_OK(image);
    if (image.ok()) mine_ = image->reconstruction;
    for (const ReconstructionAnswer& one : city_.Counts().reconstructions)
      if (one.id != mine_) other_ = one.id;
  }

  HttpAnswer Get(const Sight& sight, std::vector<std::string> path) {
    HttpRequest request;
    request.method = "GET";
    request.path = std::move(path);
    request.sight = sight;
    const auto found = FindRoute(request);
    const RouteMatch& match = std::get<RouteMatch>(found);
    return match.route->answer(&city_.engine(), request, match.arguments);
  }
  HttpAnswer Get(const Sight& sight, ReconstructionId id, const std::vector<std::string>& more) {
    std::vector<std::string> path = {"v1", "reconstructions", std::to_string(id.value)};
    path.insert(path.end(), more.begin(), more.end());
    return Get(sight, path);
  }
  size_t Count(const Sight& sight, const std::string& what) {
    return Json::parse(Get(sight, {"v1", what}).body).size();
  }
  std::vector<Sight> Parts() const {
    return {{.sees_hidden = false, .contribution = contribution_},
            {.sees_hidden = false, .reconstruction = mine_}};
  }

  static inline const Sight kWhole = {.sees_hidden = false};
  City city_;
  uint32_t contribution_ = 0;
  std::string name_;
  ReconstructionId mine_, other_;
};

TEST_F(PartsOfACity, AreToldOfTheirReconstructionAlone) {
  ASSERT_TRUE(mine_.valid() && other_.valid()) << city_.Counts().reconstructions.size();
  EXPECT_EQ(Count(kWhole, "reconstructions"), 2u);
  for (const Sight& sight : Parts()) {
    const Json told = Json::parse(Get(sight, {"v1", "reconstructions"}).body);
    ASSERT_EQ(told.size(), 1u);
    EXPECT_EQ(told[0]["id"], mine_.value);
    const Json status = Json::parse(Get(sight, {"v1", "status"}).body);
    EXPECT_EQ(status["reconstructions"].size(), 1u);
    const Json earth = Json::parse(Get(sight, {"v1", "georeference"}).body);
    EXPECT_EQ(earth["reconstructions"].size(), 1u);
    for (const std::vector<std::string>& more :
         {std::vector<std::string>{}, {"points"}, {"surface", "tileset.json"}}) {
      EXPECT_EQ(Get(kWhole, other_, more).code, more.size() == 2 ? 404u : 200u);
      EXPECT_EQ(Get(sight, mine_, more).code, more.size() == 2 ? 404u : 200u);
      const HttpAnswer refused = Get(sight, other_, more);
      EXPECT_EQ(refused.code, 404u);
      EXPECT_NE(refused.body.find("there is no reconstruction"), std::string::npos) << refused.body;
    }
    const HttpAnswer tile = Get(sight, other_, {"surface", "tiles", "0_0_0_0_00000000.glb"});
    EXPECT_EQ(tile.code, 404u);
    EXPECT_NE(tile.body.find("there is no reconstruction"), std::string::npos) << tile.body;
  }
}

TEST_F(PartsOfACity, AreToldOfNoMergeAndOfTheirCamerasAlone) {
  ASSERT_OK(city_.engine().AddCamera("unused", StreetCameraModel(), "a test"));
  EXPECT_GE(Count(kWhole, "hypotheses"), 1u);
  EXPECT_EQ(Count(kWhole, "cameras"), 2u);
  const auto hypotheses_of = [&](const HttpAnswer& answer) {
    return Json::parse(answer.body)["hypotheses"].size();
  };
  EXPECT_GE(hypotheses_of(Get(kWhole, mine_, {})), 1u);
  EXPECT_GE(hypotheses_of(Get(kWhole, {"v1", "photos", name_})), 1u);
  for (const Sight& sight : Parts()) {
    EXPECT_EQ(Count(sight, "hypotheses"), 0u);
    EXPECT_EQ(hypotheses_of(Get(sight, mine_, {})), 0u);
    EXPECT_EQ(hypotheses_of(Get(sight, {"v1", "photos", name_})), 0u);
    EXPECT_EQ(Count(sight, "cameras"), 1u);
    EXPECT_EQ(Get(sight, {"v1", "cameras", "street"}).code, 200u);
    EXPECT_EQ(Get(sight, {"v1", "cameras", "unused"}).code, 404u);
  }
}

TEST_F(PartsOfACity, WhatIsHiddenIsInNoSeamAndShowsNoSurveyedPoint) {
  const auto hypotheses = city_.engine().Ask().Hypotheses();
  ASSERT_OK(hypotheses);
  ASSERT_FALSE(hypotheses->empty());
  const ImageId proposed = hypotheses->front().image;
  ASSERT_TRUE(proposed.valid());
  {
    Writer::Turn turn = city_.parts().writer->Take();
    const auto transaction = turn.database().BeginTransaction();
    transaction->PutGroundPoint({"corner",
                                 {47, 15, 300},
                                 0.05,
                                 {{proposed, 10, 10}, {ImageId(proposed.value + 1), 20, 20}}});
    ASSERT_OK(transaction->Commit());
  }
  ASSERT_OK(city_.engine().Hide({{"#" + std::to_string(proposed.value)}, 0, "kai", "a test"}));
  const auto sightings = [&](const Sight& sight) {
    return Json::parse(Get(sight, {"v1", "georeference"}).body)["ground_points"][0]["sightings"];
  };
  EXPECT_EQ(sightings({}).size(), 2u) << "to curators";
  ASSERT_EQ(sightings(kWhole).size(), 1u);
  EXPECT_EQ(sightings(kWhole)[0]["id"], proposed.value + 1);
  EXPECT_EQ(city_.engine().Ask().Hypotheses()->front().image, proposed);
  const auto told = city_.engine().Ask(kWhole).Hypotheses();
  ASSERT_OK(told);
  for (const HypothesisAnswer& one : *told) {
    EXPECT_NE(one.image, proposed);
    EXPECT_EQ(std::ranges::count(one.unsure, proposed), 0);
  }
}

TEST_F(PartsOfACity, ALinkFollowsWhatItsReconstructionWasMergedInto) {
  {
    Writer::Turn turn = city_.parts().writer->Take();
    const auto transaction = turn.database().BeginTransaction();
    for (const auto& [id, into] : {std::pair(7u, ReconstructionId(8)), {8u, mine_}, {9u, mine_}}) {
      ReconstructionRecord merged;
      merged.id = ReconstructionId(id);
      merged.merged_into = into;
      transaction->PutReconstruction(merged);
    }
    ASSERT_OK(transaction->Commit());
  }
  const Sight link = {.sees_hidden = false, .reconstruction = ReconstructionId(7)};
  for (const ReconstructionId seen : {ReconstructionId(7), ReconstructionId(8), mine_})
    EXPECT_EQ(Get(link, seen, {}).code, 200u) << seen.value;
  for (const ReconstructionId unseen : {ReconstructionId(9), other_})
    EXPECT_EQ(Get(link, unseen, {}).code, 404u) << unseen.value;
  EXPECT_EQ(Get(link, mine_, {"points"}).code, 200u);
}

}  // namespace
}  // namespace veduta
