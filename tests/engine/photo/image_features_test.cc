// SPDX-License-Identifier: Apache-2.0
// Goal: an image's features come from the database as they were stored, with its camera; the cache
//   keeps the newest within its bound and gives the same object again.
// Method: two images written to a database in a temporary folder.
#include "engine/photo/image_features.h"

#include <gtest/gtest.h>

#include "engine/matching/mutual_matcher.h"
#include "engine/photo/carried_features.h"
#include "tests/storage/samples.h"

namespace veduta {
namespace {

Features MadeFeatures(uint64_t seed, size_t count) {
  SeededRandom random(seed);
  Features features;
  for (size_t i = 0; i < count; ++i) {
    Keypoint keypoint;
    keypoint.x_px = static_cast<float>(100 * random.Unit());
    keypoint.y_px = static_cast<float>(80 * random.Unit());
    keypoint.scale_px = 2;
    keypoint.contrast_sign = i % 2 ? 1 : -1;
    features.keypoints.push_back(keypoint);
  }
  features.descriptors = SampleBytes(seed, count * kDescriptorSize);
  return features;
}

CameraModel Model() {
  CameraModel model;
  model.width_px = 100;
  model.height_px = 80;
  model.fx = model.fy = 90;
  model.cx = model.u0 = 50;
  model.cy = model.v0 = 40;
  return model;
}

class ImageFeaturesTest : public testing::Test {
 protected:
  void SetUp() override {
    auto opened = Database::Open(folder_ / "db", {.create = true, .sync_wal = false});
    ASSERT_OK(opened);
    database_ = std::move(*opened);
    const auto transaction = database_->BeginTransaction();
    transaction->PutCamera({CameraId(1), "camera", Model(), "made"});
    for (const uint32_t id : {1u, 2u}) {
      ImageRecord image;
      image.id = ImageId(id);
      image.name = "image" + std::to_string(id);
      image.photo = HashContent(SampleBytes(id, 10));
      image.camera = CameraId(1);
      image.width_px = 100;
      image.height_px = 80;
      image.verdict = Verdict::kPostponed;
      image.reason = Reason::kNoCandidates;
      image.feature_count = 30;
      ASSERT_OK(database_->WritePhotoAhead(image.photo, SampleBytes(id, 10), MadeFeatures(id, 30)));
      transaction->PutImage(image);
    }
    ASSERT_OK(transaction->Commit());
  }

  TemporaryFolder folder_;
  std::unique_ptr<Database> database_;
};

TEST_F(ImageFeaturesTest, AreThoseStored) {
  ImageFeatureCache cache(1 << 20, 20);
  const auto image = cache.Get(*database_->GetSnapshot(), ImageId(2));
  ASSERT_OK(image);
  EXPECT_EQ((*image)->id, ImageId(2));
  EXPECT_EQ((*image)->features->descriptors, MadeFeatures(2, 30).descriptors);
  EXPECT_EQ((*image)->features->keypoints, MadeFeatures(2, 30).keypoints);
  EXPECT_EQ((*image)->width_px, 100u);
  EXPECT_EQ((*image)->camera.fx, 90);
  EXPECT_EQ((*image)->grid->feature_count(), 30u);
  EXPECT_EQ((*image)->Packed()->count(), 20u) << "the strongest alone are matched";
  EXPECT_GT((*image)->size_bytes(), 30u * kDescriptorSize);
  EXPECT_EQ(cache.Get(*database_->GetSnapshot(), ImageId(3)).status().code(),
            StatusCode::kNotFound);
}

TEST_F(ImageFeaturesTest, LieWhereTheLensOfTheSnapshotHasThem) {
  ImageFeatureCache cache(1 << 20, 20);
  const auto before = database_->GetSnapshot();
  const auto old = *cache.Get(*before, ImageId(2));
  CameraRecord refined{CameraId(1), "camera", Model(), "made"};
  refined.refined_from = refined.model;
  refined.model.fx = 95, refined.model.k1 = 0.1;
  const auto transaction = database_->BeginTransaction();
  transaction->PutCamera(refined);
  ASSERT_OK(transaction->Commit());
  const auto now = *cache.Get(*database_->GetSnapshot(), ImageId(2));
  EXPECT_EQ(now->camera.fx, 95);
  EXPECT_EQ(now->lens, refined.model);
  EXPECT_EQ(now->features->descriptors, old->features->descriptors);
  EXPECT_EQ(now->features->keypoints, Carried(refined, old->features)->keypoints);
  EXPECT_NE(now->features->keypoints, old->features->keypoints);
  EXPECT_EQ(*cache.Get(*database_->GetSnapshot(), ImageId(2)), now) << "kept";
  EXPECT_EQ((*cache.Get(*before, ImageId(2)))->features->keypoints, old->features->keypoints);
}

TEST_F(ImageFeaturesTest, MatchesAreThoseOfTheMatcherAndAreKept) {
  const auto snapshot = database_->GetSnapshot();
  ImageFeatureCache cache(1 << 20, 20);
  const auto matches = cache.Match(*snapshot, {ImageId(1)}, {ImageId(2)}, 0.99);
  ASSERT_OK(matches);
  const auto first = *cache.Get(*snapshot, ImageId(1)), second = *cache.Get(*snapshot, ImageId(2));
  MatchOptions options;
  options.ratio_max = 0.99;
  const auto expect = [](const std::vector<DescriptorMatch>& wanted,
                         const std::vector<FeatureMatch>& found) {
    ASSERT_EQ(found.size(), wanted.size());
    for (size_t i = 0; i < found.size(); ++i)
      EXPECT_EQ(found[i], (FeatureMatch{wanted[i].a, wanted[i].b}));
  };
  ASSERT_FALSE((*matches)->from_first.empty());
  expect(MatchMutual(*first->Packed(), *second->Packed(), options), (*matches)->from_first);
  expect(MatchMutual(*second->Packed(), *first->Packed(), options), (*matches)->from_second);
  EXPECT_EQ(*cache.Match(*snapshot, {ImageId(1)}, {ImageId(2)}, 0.99), *matches) << "kept";
  ImageFeatureCache other(1 << 20, 20);
  const auto held =
      other.Match(*snapshot, {ImageId(1), first->features}, {ImageId(2), second->features}, 0.99);
  ASSERT_OK(held);
  EXPECT_EQ((*held)->from_first, (*matches)->from_first) << "of features that somebody else holds";
  const auto strict = cache.Match(*snapshot, {ImageId(1)}, {ImageId(2)}, 0.9);
  ASSERT_OK(strict);
  EXPECT_LT((*strict)->from_first.size(), (*matches)->from_first.size());
  EXPECT_EQ(cache.Match(*snapshot, {ImageId(1)}, {ImageId(3)}, 0.99).status().code(),
            StatusCode::kNotFound);
}

TEST_F(ImageFeaturesTest, TheCacheDoesNotKeepThemLaidOut) {
  const auto features = std::make_shared<const Features>(MadeFeatures(7, 30));
  const auto on_demand = *ImageFeatures::Make(ImageId(2), Model(), features, 20),
             kept = *ImageFeatures::Make(ImageId(2), Model(), features, 20,
                                         ImageFeatures::Packing::kKept);
  EXPECT_EQ(kept->Packed(), kept->Packed());
  EXPECT_EQ(kept->Packed()->count(), on_demand->Packed()->count());
  EXPECT_EQ(kept->size_bytes(), on_demand->size_bytes() + kept->Packed()->size_bytes());
  ImageFeatureCache cache(1 << 20, 20);
  cache.Put(HashContent(SampleBytes(2, 10)), kept);
  const auto stored = *cache.Get(*database_->GetSnapshot(), ImageId(2));
  EXPECT_EQ(stored->features, features);
  EXPECT_EQ(stored->size_bytes(), on_demand->size_bytes());
}

TEST_F(ImageFeaturesTest, TheCacheKeepsTheNewest) {
  const auto snapshot = database_->GetSnapshot();
  ImageFeatureCache roomy(1 << 20, 20), tight(1, 20);
  const auto first = *roomy.Get(*snapshot, ImageId(1));
  EXPECT_OK(roomy.Get(*snapshot, ImageId(2)).status());
  EXPECT_EQ(*roomy.Get(*snapshot, ImageId(1)), first) << "kept";
  const auto kept = *tight.Get(*snapshot, ImageId(1));
  EXPECT_EQ(*tight.Get(*snapshot, ImageId(1)), kept) << "the newest stays, however large";
  EXPECT_OK(tight.Get(*snapshot, ImageId(2)).status());
  EXPECT_NE(*tight.Get(*snapshot, ImageId(1)), kept) << "it was given up for image 2";
  const auto made = *ImageFeatures::Make(ImageId(2), Model(),
                                         std::make_shared<const Features>(MadeFeatures(7, 5)), 20);
  ImageFeatureCache empty(1 << 20, 20);
  empty.Put(HashContent(SampleBytes(2, 10)), made);
  EXPECT_EQ(*empty.Get(*snapshot, ImageId(2)), made) << "its features need not be stored";
}

TEST_F(ImageFeaturesTest, AnImageWithAnotherPhotoHasOtherFeatures) {
  const auto before = database_->GetSnapshot();
  ImageFeatureCache cache(1 << 20, 20);
  const auto first = *cache.Get(*before, ImageId(2));
  const auto matches = *cache.Match(*before, {ImageId(1)}, {ImageId(2)}, 0.99);
  const std::vector<uint8_t> bytes = SampleBytes(5, 10);
  const auto transaction = database_->BeginTransaction();
  ImageRecord image = *before->GetImage(ImageId(2));
  transaction->DeletePhoto(image.photo);
  image.photo = HashContent(bytes);
  image.feature_count = 40;
  ASSERT_OK(database_->WritePhotoAhead(image.photo, bytes, MadeFeatures(5, 40)));
  transaction->PutImage(image);
  ASSERT_OK(transaction->Commit());
  const auto after = database_->GetSnapshot();
  EXPECT_EQ((*cache.Get(*after, ImageId(2)))->features->keypoints, MadeFeatures(5, 40).keypoints);
  EXPECT_EQ(*cache.Get(*before, ImageId(2)), first) << "as it was in this snapshot";
  EXPECT_NE(*cache.Match(*after, {ImageId(1)}, {ImageId(2)}, 0.99), matches);
  EXPECT_EQ(*cache.Match(*before, {ImageId(1)}, {ImageId(2)}, 0.99), matches);
  EXPECT_EQ(after->GetPhoto(HashContent(SampleBytes(2, 10))).status().code(),
            StatusCode::kNotFound);
  EXPECT_EQ(*after->FindImageByPhoto(image.photo), ImageId(2));
  EXPECT_EQ(*after->FindImageByPhoto(HashContent(SampleBytes(2, 10))), std::nullopt);
}

TEST_F(ImageFeaturesTest, MoreThanCanBePackedIsRefused) {
  EXPECT_EQ(ImageFeatures::Make(ImageId(1), Model(),
                                std::make_shared<const Features>(MadeFeatures(1, 5)), 65536)
                .status()
                .code(),
            StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace veduta
