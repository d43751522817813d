// SPDX-License-Identifier: Apache-2.0
// Goal: the surface is told with tags by which it need not be sent twice, and what is not there is
//   a problem that says what to do.
// Method: a street of a few photos, before a dense pass and after it.
#include "cli/service/surface_answers.h"

#include <map>

#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

TEST(SurfaceAnswers, AreTaggedAndSayWhatIsMissing) {
  City city;
  city.Add({{20.0, 90}, {20.7, 90}, {21.4, 90}, {22.1, 90}});
  Engine* const engine = &city.engine();
  HttpRequest request;
  EXPECT_EQ(AnswerWithTileset(engine, request, {"none"}).code, 400u);
  EXPECT_EQ(AnswerWithTileset(engine, request, {"7"}).code, 404u);
  const HttpAnswer none = AnswerWithTileset(engine, request, {"1"});
  EXPECT_EQ(none.code, 404u);
  EXPECT_EQ(none.content_type, "application/problem+json");
  EXPECT_NE(none.body.find("veduta densify"), std::string::npos);

  DensifyRequest densify;
  densify.device = "cpp";
  densify.options.depth_side_px = 96;
  ASSERT_OK(engine->Densify(densify));
  const HttpAnswer tileset = AnswerWithTileset(engine, request, {"1"});
  ASSERT_EQ(tileset.code, 200u);
  EXPECT_EQ(tileset.content_type, "application/json");
  request.if_none_match = HeaderOf(tileset, "ETag");
  ASSERT_OK(engine->AddCamera("another", StreetCameraModel(), "a test"));
  const HttpAnswer same = AnswerWithTileset(engine, request, {"1"});
  EXPECT_EQ(same.code, 304u) << "a commit that changes no surface";
  EXPECT_TRUE(same.body.empty());

  const size_t begin = tileset.body.find("tiles/") + 6;
  const std::string file = tileset.body.substr(begin, tileset.body.find(".glb") + 4 - begin);
  const HttpAnswer tile = AnswerWithSurfaceTile(engine, {}, {"1", file});
  ASSERT_EQ(tile.code, 200u) << tile.body;
  EXPECT_EQ(tile.body.substr(0, 4), "glTF");
  EXPECT_NE(HeaderOf(tile, "Cache-Control").find("immutable"), std::string::npos);
  request.if_none_match = HeaderOf(tile, "ETag");
  EXPECT_EQ(AnswerWithSurfaceTile(engine, request, {"1", file}).code, 304u);
  for (const char* wrong : {"x.glb", "0_0_0_0_0123456789abcdef.glb", "tileset.json", "", ".glb"})
    EXPECT_EQ(AnswerWithSurfaceTile(engine, {}, {"1", wrong}).code, 404u) << wrong;
}

TEST(SurfaceAnswers, ACoarseTileWithoutADamagedPartIsKeptByNobody) {
  City city;
  city.Add({{20.0, 90}, {20.7, 90}, {21.4, 90}, {22.1, 90}});
  DensifyRequest densify;
  densify.device = "cpp";
  densify.options.depth_side_px = 96;
  densify.options.voxel_px = 0.7;  // of some more tiles
  ASSERT_OK(city.engine().Densify(densify));
  {
    Writer::Turn turn = city.parts().writer->Take();
    const auto transaction = turn.database().BeginTransaction();
    GridPlace place;
    ASSERT_OK(turn.database().GetSnapshot()->dense().ScanTiles(ReconstructionId(1),
                                                               [&](const TileRecord& tile) {
                                                                 if (tile.triangle_count > 0)
                                                                   place = tile.place;
                                                                 return true;
                                                               }));
    const std::vector<uint8_t> damaged(100, 0xFF);
    transaction->dense().PutSurface(SurfacePart::kMesh, ReconstructionId(1), place, damaged);
    ASSERT_OK(transaction->Commit());
  }
  const HttpAnswer tileset = AnswerWithTileset(&city.engine(), {}, {"1"});
  const std::string uri = Json::parse(tileset.body)["root"]["content"]["uri"];
  const HttpAnswer root =
      AnswerWithSurfaceTile(&city.engine(), {}, {"1", uri.substr(uri.find('/') + 1)});
  ASSERT_EQ(root.code, 200u) << root.body;
  EXPECT_EQ(root.body.substr(0, 4), "glTF");
  EXPECT_EQ(HeaderOf(root, "Cache-Control"), "no-store");
  EXPECT_EQ(HeaderOf(root, "ETag"), "");
  ASSERT_EQ(root.damages.size(), 1u);
  EXPECT_NE(root.damages[0].find("is left out"), std::string::npos) << root.damages[0];
}

}  // namespace
}  // namespace veduta
