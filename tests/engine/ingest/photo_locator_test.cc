// SPDX-License-Identifier: Apache-2.0
// Goal: a photo is placed by its neighbours among the candidates; one without candidates or without
//   a verified neighbour is postponed with that reason; one that few features do not place is
//   searched once more by many.
// Method: a synthetic scene in a database; the number of features matched is set too small.
#include "engine/ingest/photo_locator.h"

#include <gtest/gtest.h>

#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

LocatedPhoto Locate(SceneDatabase* scene, const ImageFeatures& photo,
                    const std::vector<RankedImage>& candidates, const IngestOptions& options = {}) {
  SceneWork work(scene);
  auto located =
      LocatePhoto(work.context, options, photo, scene->Model(), candidates, ReconstructionId(9), 1);
  EXPECT_OK(located);
  return located.ok() ? std::move(*located) : LocatedPhoto();
}

TEST(PhotoLocator, PlacesByTheCandidates) {
  SceneDatabase scene;
  scene.AddImages(0, 4);
  scene.AddReconstruction({0, 1, 2, 3});
  const LocatedPhoto located = Locate(&scene, *scene.Photo(4), {{ImageId(1), 0}});
  EXPECT_EQ(located.placement.verdict, Verdict::kPlaced) << located.placement.detail;
  EXPECT_EQ(located.search.pairs.size(), 4u);
  EXPECT_GT(located.times.match_ms, 0);
}

TEST(PhotoLocator, SaysWhenThereIsNobodyToAsk) {
  SceneDatabase scene;
  const LocatedPhoto first = Locate(&scene, *scene.Photo(4), {});
  EXPECT_EQ(first.placement.verdict, Verdict::kPostponed);
  EXPECT_EQ(first.placement.reason, Reason::kNoCandidates);
  scene.AddImages(0, 1);
  const SceneDatabase other({.seed = 5});
  const auto stranger =
      *ImageFeatures::Make(ImageId(9), scene.Model(), other.Photo(0)->features, 1500);
  const LocatedPhoto alone = Locate(&scene, *stranger, {{ImageId(1), 0}});
  EXPECT_EQ(alone.placement.reason, Reason::kNoVerifiedNeighbor);
  EXPECT_NE(alone.placement.detail.find("none of 1 candidates"), std::string::npos)
      << alone.placement.detail;
}

TEST(PhotoLocator, SearchesOnceMoreByMoreFeatures) {
  SceneDatabase scene;
  scene.AddImages(0, 4);
  scene.AddReconstruction({0, 1, 2, 3});
  IngestOptions options;
  options.thorough_count_max = 15;
  const LocatedPhoto blind = Locate(&scene, *scene.Photo(4, 15), {{ImageId(1), 0}}, options);
  EXPECT_EQ(blind.placement.verdict, Verdict::kPostponed);
  options.thorough_count_max = 4096;
  const LocatedPhoto seeing = Locate(&scene, *scene.Photo(4, 15), {{ImageId(1), 0}}, options);
  EXPECT_EQ(seeing.placement.verdict, Verdict::kPlaced) << seeing.placement.detail;
}

}  // namespace
}  // namespace veduta
