// SPDX-License-Identifier: Apache-2.0
// Goal: every photo gets its answer: placed where it was taken, merged, postponed and placed
//   later, or rejected with the reason; and the database is sound after each.
// Method: photos of a synthetic street with known poses go through the whole engine; files are
//   spoilt in each way that has a reason of its own.
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "engine/features/extractor.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

constexpr double kCenterErrorMMax = 0.05, kCenterErrorMMedianMax = 0.03, kAngleErrorDegMax = 0.4;

void ExpectTruePoses(const Snapshot& snapshot, ReconstructionId id,
                     const std::vector<Stand>& stands, size_t count) {
  const PoseErrors errors = CompareWithTruth(snapshot, id, stands);
  EXPECT_EQ(errors.count, count);
  EXPECT_LT(errors.center_m_median, kCenterErrorMMedianMax);
  EXPECT_LT(errors.center_m_max, kCenterErrorMMax);
  EXPECT_LT(errors.angle_deg_max, kAngleErrorDegMax);
}

bool IsPlaced(Verdict verdict) {
  return verdict != Verdict::kPostponed && verdict != Verdict::kRejected;
}

// A grey photo of the camera's size, every pixel by `level`.
template <typename Level>
std::vector<uint8_t> MadePhoto(uint32_t width_px, uint32_t height_px, const Level& level) {
  street::StreetPhoto photo{
      width_px, height_px, std::vector<uint8_t>(size_t{3} * width_px * height_px), {}};
  for (uint32_t y = 0; y < height_px; ++y) {
    for (uint32_t x = 0; x < width_px; ++x) {
      for (int c = 0; c < 3; ++c)
        photo.rgb[(size_t{y} * width_px + x) * 3 + static_cast<size_t>(c)] = level(x, y);
    }
  }
  return *street::EncodeJpeg(photo, 92);
}

TEST(Ingest, OneWalkBecomesOneReconstruction) {
  const std::vector<Stand> stands = Walk(6, 0.9, 9);
  City city;
  const std::vector<AddOutcome> outcomes = city.Add(stands);
  SCOPED_TRACE(Told(outcomes));
  EXPECT_EQ(outcomes[0].verdict, Verdict::kPostponed);
  EXPECT_EQ(outcomes[0].reason, Reason::kNoCandidates);
  EXPECT_EQ(outcomes[1].verdict, Verdict::kPostponed);
  EXPECT_EQ(outcomes[1].reason, Reason::kNoGoodTriple);
  EXPECT_EQ(outcomes[1].neighbor_count, 1u);
  EXPECT_EQ(outcomes[2].verdict, Verdict::kFounded);
  for (size_t i = 0; i < outcomes.size(); ++i) {
    EXPECT_EQ(outcomes[i].name, TakePhoto(stands[i]).name);
    EXPECT_EQ(outcomes[i].id, ImageId(static_cast<uint32_t>(i + 1)));
    EXPECT_GT(outcomes[i].times.total_ms, 0);
    if (i < 3) continue;
    EXPECT_EQ(outcomes[i].verdict, Verdict::kPlaced);
    EXPECT_EQ(outcomes[i].reconstruction, outcomes[2].reconstruction);
    EXPECT_GE(outcomes[i].inlier_count, 20u);
  }
  const CityQuestions ask = city.Ask();
  EXPECT_TRUE(IsSound(ask.snapshot()));
  ExpectTruePoses(ask.snapshot(), outcomes[2].reconstruction, stands, stands.size());
  // The two that founded with the third say so.
  for (int i : {0, 1})
    EXPECT_EQ(ask.FindImage(TakePhoto(stands[static_cast<size_t>(i)]).name)->verdict,
              Verdict::kFounded);
  const StatusAnswer status = city.Counts();
  EXPECT_EQ(status.images, stands.size());
  EXPECT_EQ(status.placed, stands.size());
  EXPECT_EQ(status.backlog, 0u);
  ASSERT_EQ(status.reconstructions.size(), 1u);
  EXPECT_EQ(status.reconstructions[0].images, stands.size());
  EXPECT_LT(status.reconstructions[0].reprojection_error_px_mean, 1.0);
}

TEST(Ingest, TheSameBytesAreAddedOnce) {
  City city;
  const std::vector<Stand> stands = Walk(6, 0.9, 3);
  city.Add(stands);
  const std::string digest = city.Digest();
  const TakenPhoto& photo = TakePhoto(stands[1]);
  for (const char* name : {photo.name.c_str(), "other/name.jpg"}) {
    const AddOutcome again = city.AddOne(name, photo.jpeg);
    EXPECT_TRUE(again.duplicate);
    EXPECT_EQ(again.id, ImageId(2));
    EXPECT_NE(again.detail.find(photo.name), std::string::npos) << again.detail;
  }
  EXPECT_EQ(city.Digest(), digest);
  // Twice within one call, both prepared before either is stored.
  const std::vector<uint8_t>& fresh = TakePhoto({8.7, 90}).jpeg;
  const std::vector<AddOutcome> outcomes = city.Add(
      {city.Submit("x.jpg", fresh), city.Submit("y.jpg", fresh), city.Submit("x.jpg", fresh)});
  EXPECT_FALSE(outcomes[0].duplicate);
  EXPECT_TRUE(outcomes[1].duplicate);
  EXPECT_TRUE(outcomes[2].duplicate);
  EXPECT_EQ(outcomes[1].id, outcomes[0].id);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  city.Reopen();
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

TEST(Ingest, ContributorsNameTheirPhotosEachForThemselves) {
  City city;
  const std::vector<Stand> stands = Walk(6, 0.9, 4);
  std::vector<PhotoSubmission> photos;
  for (size_t i = 0; i < stands.size(); ++i) {
    photos.push_back(city.Submit(i < 2 ? "IMG_1.jpg" : "IMG_2.jpg", TakePhoto(stands[i]).jpeg));
    photos.back().contributor = i % 2 == 0 ? "anna" : "bert";
  }
  const std::vector<AddOutcome> outcomes = city.Add(photos);
  for (uint32_t i = 0; i < 4; ++i) {
    EXPECT_EQ(outcomes[i].id, ImageId(i + 1)) << ReasonText(outcomes[i].reason);
    EXPECT_TRUE(city.Ask().Pose(ImageId(i + 1))->has_value());
  }
  city.Reopen();
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  EXPECT_EQ(city.Ask().FindImage("bert/IMG_1.jpg")->id, ImageId(2));
  EXPECT_EQ(city.Ask().FindImage("IMG_1.jpg").status().code(), StatusCode::kInvalidArgument);
  // Taking one out leaves the other its name.
  RemoveRequest request;
  request.photos = {"anna/IMG_1.jpg"};
  ASSERT_OK(city.engine().Remove(request));
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  EXPECT_EQ(city.Ask().FindImage("IMG_1.jpg")->id, ImageId(2));
}

TEST(Ingest, ANameBelongsToItsPhoto) {
  City city;
  const std::vector<Stand> stands = Walk(6, 0.9, 2);
  city.Add(stands);
  const std::string digest = city.Digest();
  const std::vector<uint8_t>& other = TakePhoto({7.8, 90}).jpeg;
  const AddOutcome refused = city.AddOne(TakePhoto(stands[0]).name, other);
  EXPECT_EQ(refused.verdict, Verdict::kRejected);
  EXPECT_EQ(refused.reason, Reason::kNameTaken);
  EXPECT_FALSE(refused.id.valid());
  EXPECT_FALSE(refused.duplicate);
  EXPECT_EQ(city.Digest(), digest);
  EXPECT_TRUE(IsSound(city.Ask().snapshot())) << "what was written ahead of it must be gone";
  // The same bytes under a taken and under a free name, prepared together: the one must not take
  // the other's blobs.
  const std::vector<AddOutcome> outcomes =
      city.Add({city.Submit(TakePhoto(stands[0]).name, other), city.Submit("free.jpg", other),
                city.Submit(TakePhoto(stands[1]).name, other)});
  EXPECT_EQ(outcomes[0].reason, Reason::kNameTaken);
  EXPECT_TRUE(outcomes[1].id.valid());
  EXPECT_TRUE(outcomes[2].duplicate);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  city.Reopen();
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

struct Bad {
  std::string name;
  std::vector<uint8_t> bytes;
  Reason reason;
};

constexpr uint64_t kSizeBytesMax = 2'000'000;

// A file for every reason to reject one, where at most kSizeBytesMax bytes are taken.
std::vector<Bad> BadFiles(const TakenPhoto& good) {
  const CameraModel camera = StreetCameraModel();
  std::vector<uint8_t> cut(good.jpeg.begin(),
                           good.jpeg.begin() + static_cast<std::ptrdiff_t>(good.jpeg.size() / 2));
  const std::string text = "this is not a photo but a letter to the editor";
  const auto black = [](uint32_t, uint32_t) { return uint8_t{0}; };
  const auto blurred = [](uint32_t x, uint32_t y) {
    return static_cast<uint8_t>(128 + 60 * std::sin(x / 90.0) * std::sin(y / 90.0));
  };
  return {
      {"empty.jpg", {}, Reason::kEmptyFile},
      {"letter.jpg", {text.begin(), text.end()}, Reason::kUnsupportedFormat},
      {"cut.jpg", cut, Reason::kUnreadable},
      {"small.jpg",
       MadePhoto(320, 240, [](uint32_t x, uint32_t y) { return static_cast<uint8_t>(x * y); }),
       Reason::kWrongSize},
      {"black.jpg", MadePhoto(camera.width_px, camera.height_px, black), Reason::kNoTexture},
      {"blurred.jpg", MadePhoto(camera.width_px, camera.height_px, blurred), Reason::kNoTexture},
      {"huge.jpg", std::vector<uint8_t>(kSizeBytesMax + 1, 7), Reason::kTooLarge},
  };
}

TEST(Ingest, EachBadPhotoHasItsReason) {
  CityOptions options = City::Options(2);
  options.prepare.limits.size_bytes_max = kSizeBytesMax;
  City city(options);
  const TakenPhoto& good = TakePhoto({8, 90});
  const std::vector<Bad> bad = BadFiles(good);
  std::vector<PhotoSubmission> photos = {city.Submit("good.jpg", good.jpeg)};
  for (const Bad& b : bad) photos.push_back(city.Submit(b.name, b.bytes));
  const std::vector<AddOutcome> outcomes = city.Add(photos);
  SCOPED_TRACE(Told(outcomes));
  EXPECT_EQ(outcomes[0].verdict, Verdict::kPostponed);
  for (size_t i = 1; i < photos.size(); ++i) {
    const Reason expected = bad[i - 1].reason;
    EXPECT_EQ(outcomes[i].verdict, Verdict::kRejected) << outcomes[i].name;
    EXPECT_EQ(outcomes[i].reason, expected)
        << outcomes[i].name << ": " << ReasonText(outcomes[i].reason);
    EXPECT_FALSE(outcomes[i].detail.empty()) << outcomes[i].name;
    const auto stored = city.Ask().FindImage(outcomes[i].name);
    ASSERT_OK(stored);
    EXPECT_EQ(stored->id, outcomes[i].id);
    EXPECT_EQ(stored->reason, expected);
    EXPECT_EQ(stored->detail, outcomes[i].detail);
  }
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  EXPECT_EQ(city.Counts().rejected, photos.size() - 1);
  // The same again is the same answer, and no second record.
  const std::string digest = city.Digest();
  const std::vector<AddOutcome> again = city.Add(photos);
  for (size_t i = 1; i < photos.size(); ++i) {
    EXPECT_EQ(again[i].reason, outcomes[i].reason);
    EXPECT_EQ(again[i].id, outcomes[i].id);
  }
  EXPECT_EQ(city.Digest(), digest);
}

// What cannot be read says nothing about the photo: no verdict is stored, and the others go on.
TEST(Ingest, WhatCannotBeReadIsNoVerdict) {
  City city;
  const TakenPhoto& good = TakePhoto({8, 90});
  std::vector<PhotoSubmission> photos(2, city.Submit("absent.jpg", {}));
  photos[0].photo = {"absent.jpg", city.path() + "/absent.jpg", {}};
  photos[1].photo = {"folder.jpg", city.path(), {}};
  photos.push_back(city.Submit("good.jpg", good.jpeg));
  const std::vector<AddOutcome> outcomes = city.Add(photos);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_FALSE(outcomes[i].failure.ok()) << outcomes[i].name;
    EXPECT_FALSE(outcomes[i].id.valid());
    EXPECT_FALSE(city.Ask().FindImage(outcomes[i].name).ok());
  }
  EXPECT_OK(outcomes[2].failure);
  EXPECT_EQ(city.Counts().images, 1u);
}

TEST(Ingest, ARejectedPhotoMayComeAgainMended) {
  City city;
  const std::vector<Stand> stands = Walk(6, 0.9, 4);
  std::vector<PhotoSubmission> photos;
  for (const Stand& stand : stands) photos.push_back(city.Submit(stand));
  std::vector<PhotoSubmission> spoilt = photos;
  spoilt[1].photo.bytes->resize(spoilt[1].photo.bytes->size() / 3);
  EXPECT_EQ(city.Add(spoilt)[1].reason, Reason::kUnreadable);
  const AddOutcome mended = city.Add({photos[1]}).front();
  EXPECT_TRUE(IsPlaced(mended.verdict)) << ReasonText(mended.reason) << ": " << mended.detail;
  EXPECT_EQ(mended.id, ImageId(2));
  EXPECT_EQ(city.Counts().rejected, 0u);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  // Once accepted it stays: the spoilt bytes do not replace it.
  EXPECT_EQ(city.Add({spoilt[1]}).front().reason, Reason::kNameTaken);
  EXPECT_TRUE(city.Ask().Pose(ImageId(2))->has_value());
  ExpectTruePoses(city.Ask().snapshot(), mended.reconstruction, stands, 4);
}

TEST(Ingest, TwoSitesMergeWhenABridgeIsWalked) {
  // So far apart that no photo of the one sees enough of the other to join them.
  const std::vector<Stand> first = Walk(6, 0.9, 5), second = Walk(26, 0.9, 5),
                           bridge = Walk(10.6, 1.1, 14);
  City city;
  city.Add(first);
  city.Add(second);
  const StatusAnswer apart = city.Counts();
  ASSERT_EQ(apart.reconstructions.size(), 2u);
  EXPECT_EQ(apart.placed, 10u);
  const ReconstructionId into = apart.reconstructions[0].id, from = apart.reconstructions[1].id;
  const auto before = city.Ask();
  ExpectTruePoses(before.snapshot(), into, first, 5);
  ExpectTruePoses(before.snapshot(), from, second, 5);

  const std::vector<AddOutcome> outcomes = city.Add(bridge);
  SCOPED_TRACE(Told(outcomes));
  EXPECT_EQ(std::count_if(outcomes.begin(), outcomes.end(),
                          [](const AddOutcome& o) { return o.verdict == Verdict::kMerged; }),
            1);
  for (const AddOutcome& outcome : outcomes) EXPECT_TRUE(IsPlaced(outcome.verdict)) << outcome.name;
  const StatusAnswer joined = city.Counts();
  ASSERT_EQ(joined.reconstructions.size(), 1u);
  EXPECT_EQ(joined.reconstructions[0].images, 24u);
  const auto after = city.Ask();
  EXPECT_TRUE(IsSound(after.snapshot()));
  std::vector<Stand> all = first;
  all.insert(all.end(), second.begin(), second.end());
  all.insert(all.end(), bridge.begin(), bridge.end());
  ExpectTruePoses(after.snapshot(), joined.reconstructions[0].id, all, all.size());

  // The frame that went tells where it went, and the frame that stayed has stayed: a published
  // pose, carried over, is still where the photo is. Distances in the frame's own unit, the length
  // of the first site's walk.
  const ReconstructionId kept = joined.reconstructions[0].id, gone = kept == into ? from : into;
  const auto record = after.snapshot().GetReconstruction(gone);
  ASSERT_OK(record);
  EXPECT_EQ(record->merged_into, kept);
  EXPECT_EQ(record->image_count, 0u);
  const auto center = [](const CityQuestions& ask, uint32_t id) {
    return (*ask.Pose(ImageId(id)))->cam_from_world.Center();
  };
  const uint32_t kept_1 = kept == into ? 1 : 6, gone_1 = kept == into ? 6 : 1;
  const double walk = (center(before, kept_1) - center(before, kept_1 + 4)).norm();
  for (uint32_t k = 0; k < 5; ++k) {
    EXPECT_LT((center(before, kept_1 + k) - center(after, kept_1 + k)).norm(), 0.02 * walk);
    const Eigen::Vector3d carried = record->merged_from_this * center(before, gone_1 + k);
    EXPECT_LT((carried - center(after, gone_1 + k)).norm(), 0.05 * walk);
  }
}

TEST(Ingest, PostponedPhotosAreTriedAgainWhenANeighbourIsPlaced) {
  // Each sees something of the next but no three see the same; the two that follow close the gaps.
  const std::vector<Stand> far = {{6, 90}, {11, 90}, {16, 90}}, between = {{8.5, 90}, {13.5, 90}};
  City city;
  const std::vector<AddOutcome> waiting = city.Add(far);
  for (const AddOutcome& outcome : waiting)
    EXPECT_EQ(outcome.verdict, Verdict::kPostponed) << Told(waiting);
  const std::vector<AddOutcome> outcomes = city.Add(between);
  SCOPED_TRACE(Told(waiting) + Told(outcomes));
  EXPECT_TRUE(IsPlaced(outcomes[0].verdict));
  EXPECT_TRUE(IsPlaced(outcomes[1].verdict));
  std::vector<ImageId> propagated = outcomes[0].propagated;
  propagated.insert(propagated.end(), outcomes[1].propagated.begin(), outcomes[1].propagated.end());
  std::sort(propagated.begin(), propagated.end());
  ASSERT_EQ(propagated, (std::vector{ImageId(1), ImageId(2), ImageId(3)}));
  const auto image = city.Ask().snapshot().GetImage(ImageId(3));
  EXPECT_EQ(image->verdict, Verdict::kPlaced);
  EXPECT_EQ(image->reason, Reason::kPropagated);
  EXPECT_EQ(city.Counts().postponed, 0u);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  std::vector<Stand> all = far;
  all.insert(all.end(), between.begin(), between.end());
  ExpectTruePoses(city.Ask().snapshot(), outcomes[0].reconstruction, all, 5);
}

TEST(Ingest, StopsBetweenPhotosAndGoesOn) {
  const std::vector<Stand> stands = Walk(6, 0.9, 4);
  City city, undisturbed;
  std::vector<PhotoSubmission> photos;
  for (const Stand& stand : stands) photos.push_back(city.Submit(stand));
  std::stop_source stop;
  size_t reported = 0;
  const Status stopped = city.engine().AddPhotos(
      photos,
      [&](const AddOutcome&) {
        if (++reported == 2) stop.request_stop();
      },
      stop.get_token());
  EXPECT_EQ(stopped.code(), StatusCode::kCancelled);
  EXPECT_EQ(reported, 2u);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()))
      << "photos prepared ahead and not added must leave nothing that is seen";
  const std::vector<AddOutcome> outcomes = city.Add(photos);
  EXPECT_TRUE(outcomes[0].duplicate);
  EXPECT_FALSE(outcomes[2].duplicate);
  undisturbed.Add(stands);
  EXPECT_EQ(city.Digest(), undisturbed.Digest());
}

}  // namespace
}  // namespace veduta
