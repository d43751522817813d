// SPDX-License-Identifier: Apache-2.0
// Goal: photos that are submitted without a camera wait on the disk while it cannot be told: until
//   a city is there that tells it, or until enough of them wait to be calibrated together; over a
//   new opening of the database, and until they are removed.
// Method: photos of a rendered street, submitted one by one, most of them without their camera.
#include <gtest/gtest.h>

#include "tests/engine/camera/exif_writer.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

PhotoSubmission WithoutCamera(const Stand& stand) {
  const TakenPhoto& photo = TakePhoto(stand);
  return {{photo.name, photo.name, photo.jpeg}, "", "anna"};
}

// Near and far, along two sides.
std::vector<Stand> Around(size_t count) {
  std::vector<Stand> stands = Walk(5, 0.8, static_cast<int>(count));
  for (size_t i = 1; i < stands.size(); i += 3) stands[i].yaw_deg += 20;
  return stands;
}

std::vector<UploadAnswer> Waiting(const City& city) {
  auto uploads = city.Ask().door().Uploads();
  EXPECT_OK(uploads);
  return uploads.ok() ? *std::move(uploads) : std::vector<UploadAnswer>();
}

// What becomes of each that waits, once they are put in line.
std::vector<Result<AddOutcome>> ResumeAll(City* city) {
  std::vector<Ticket> tickets;
  for (const UploadAnswer& upload : Waiting(*city)) {
    const auto ticket = city->engine().Resume(upload.number);
    EXPECT_OK(ticket);
    tickets.push_back(*ticket);
  }
  std::vector<Result<AddOutcome>> outcomes;
  for (const Ticket& ticket : tickets) outcomes.push_back(ticket.Wait());
  return outcomes;
}

void SubmitAll(City* city, std::vector<PhotoSubmission> photos) {
  std::vector<Ticket> tickets;
  for (PhotoSubmission& photo : photos) tickets.push_back(*city->engine().Submit(std::move(photo)));
  for (const Ticket& ticket : tickets)
    EXPECT_EQ(ticket.Wait().status().code(), StatusCode::kNotFound);
}

TEST(WaitingCameras, AreToldOnceTheCityTellsThem) {
  City city;
  const std::vector<Stand> walk = Walk(5, 0.5, 12);
  SubmitAll(&city, {WithoutCamera(walk[5])});
  ASSERT_EQ(Waiting(city).size(), 1u);
  EXPECT_EQ(ResumeAll(&city).at(0).status().code(), StatusCode::kNotFound) << "as before";
  city.Reopen();
  for (size_t i = 0; i < walk.size(); ++i) {
    if (i == 5) continue;
    ASSERT_OK(city.engine().Submit(city.Submit(walk[i]))->Wait());
  }
  const Result<AddOutcome> outcome = ResumeAll(&city).at(0);
  ASSERT_OK(outcome);
  EXPECT_EQ(outcome->verdict, Verdict::kPlaced) << outcome->detail;
  EXPECT_EQ(outcome->camera.substr(0, 10), "estimated ");
  EXPECT_TRUE(Waiting(city).empty());
}

TEST(WaitingCameras, AreCalibratedTogether) {
  City city;
  std::vector<PhotoSubmission> photos;
  for (const Stand& stand : Around(14)) photos.push_back(WithoutCamera(stand));
  // What says who took it keeps no name: it is found by that.
  photos[3].photo.bytes = testing::WithExif(
      *photos[3].photo.bytes, testing::ExifOf(ExifCamera{"Maker", "Phone", "", 5.5, 0}));
  photos.push_back(photos[0]);  // sent twice
  SubmitAll(&city, photos);
  const auto nothing = city.engine().CalibrateFirst({});
  ASSERT_OK(nothing);
  EXPECT_TRUE(nothing->empty());
  const auto cameras = city.engine().CalibrateWaiting();
  ASSERT_OK(cameras);
  ASSERT_EQ(cameras->size(), 1u);
  EXPECT_EQ(cameras->front().name, "photos of 512x384") << cameras->front().why_not;
  EXPECT_EQ(cameras->front().photos, 13u);
  EXPECT_NEAR(cameras->front().model.fx / StreetCameraModel().fx, 1, 0.01);
  city.Reopen();
  size_t named = 0;
  for (const UploadAnswer& upload : Waiting(city)) named += upload.camera == "photos of 512x384";
  EXPECT_EQ(named, 13u);
  size_t placed = 0, duplicates = 0, unknown = 0;
  for (const Result<AddOutcome>& outcome : ResumeAll(&city)) {
    placed += outcome.ok() && outcome->reconstruction.valid();
    duplicates += outcome.ok() && outcome->duplicate;
    unknown += outcome.status().code() == StatusCode::kNotFound;
  }
  ASSERT_OK(city.engine().Settle());
  EXPECT_GE(city.Counts().placed, 12u);
  EXPECT_EQ(duplicates, 1u);
  EXPECT_EQ(Waiting(city).size(), unknown);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  const auto none = city.engine().CalibrateWaiting();
  ASSERT_OK(none);
  EXPECT_TRUE(none->empty()) << "the city tells cameras now";
}

TEST(WaitingCameras, GoWithTheirContributor) {
  City city;
  SubmitAll(&city, {WithoutCamera(Around(1)[0])});
  RemoveRequest request;
  request.contributor = "anna";
  const auto removed = city.engine().Remove(request);
  ASSERT_OK(removed);
  EXPECT_EQ(removed->uploads, 1u);
  EXPECT_TRUE(Waiting(city).empty());
  const auto cameras = city.engine().CalibrateWaiting();
  ASSERT_OK(cameras);
  EXPECT_TRUE(cameras->empty());
}

}  // namespace
}  // namespace veduta
