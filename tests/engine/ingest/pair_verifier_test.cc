// SPDX-License-Identifier: Apache-2.0
// Goal: a pair that sees one scene is verified with its true matches and geometry, whichever of the
//   two has the smaller id and with or without points; a pair of two scenes is not.
// Method: synthetic scenes, whose matches are known.
#include "engine/ingest/pair_verifier.h"

#include <gtest/gtest.h>

#include "tests/engine/ingest/scene_database.h"

namespace veduta {
namespace {

void ExpectTruePair(const SyntheticScene& scene, const PairVerification& verified) {
  ASSERT_EQ(verified.outcome, TwoViewOutcome::kVerified);
  const PairRecord& pair = verified.pair;
  ASSERT_LT(pair.a, pair.b);
  const uint32_t a = pair.a.value - 1, b = pair.b.value - 1;
  EXPECT_GE(pair.matches.size(), scene.Pair(a, b).matches.size() * 9 / 10);
  EXPECT_EQ(verified.inlier_count, pair.matches.size());
  for (size_t i = 0; i < pair.matches.size(); ++i) {
    EXPECT_TRUE(i == 0 || pair.matches[i - 1].a < pair.matches[i].a);
    EXPECT_EQ(scene.seen[a][pair.matches[i].a], scene.seen[b][pair.matches[i].b]);
  }
  EXPECT_LT(RotationErrorDeg(pair.b_from_a, scene.poses[b] * scene.poses[a].Inverse()), 0.5);
  EXPECT_NEAR(pair.b_from_a.translation.norm(), 1, 1e-9);
}

TEST(PairVerifier, VerifiesTheTrueMatchesEitherWayRound) {
  const SceneDatabase scene;
  const CityMap nothing;
  ExpectTruePair(scene.scene(), VerifyPair(*scene.Photo(3), *scene.Photo(1), nothing, 1, {}));
  ExpectTruePair(scene.scene(), VerifyPair(*scene.Photo(1), *scene.Photo(3), nothing, 1, {}));
}

TEST(PairVerifier, UsesTheCandidatesPoints) {
  const SceneDatabase scene;
  const CityMap map = scene.MapOf({0, 1, 2}, ReconstructionId(1));
  const PairVerification verified = VerifyPair(*scene.Photo(3), *scene.Photo(1), map, 1, {});
  ExpectTruePair(scene.scene(), verified);
  // The direction of the baseline comes from the pose, and is true even where it is short.
  const Rigid3 truth = scene.scene().poses[3] * scene.scene().poses[1].Inverse();
  EXPECT_GT(verified.pair.b_from_a.translation.dot(truth.translation.normalized()), 0.99);
}

TEST(PairVerifier, RefusesTwoScenes) {
  const SceneDatabase scene, other({.seed = 2});
  EXPECT_NE(VerifyPair(*scene.Photo(0), *other.Photo(1), {}, 1, {}).outcome,
            TwoViewOutcome::kVerified);
}

TEST(PairVerifier, WidePhotosMeetAsManyFeaturesOfTheCandidate) {
  const SceneDatabase scene;
  const size_t few = MatchImages(*scene.Photo(0, 50), *scene.Photo(1, 50)).size();
  const size_t many = MatchImages(*scene.Photo(0, 1500), *scene.Photo(1, 50)).size();
  EXPECT_LE(few, 50u);
  EXPECT_GE(many, scene.scene().Pair(0, 1).matches.size() * 9 / 10);
}

}  // namespace
}  // namespace veduta
