// SPDX-License-Identifier: Apache-2.0
// Goal: a submitted photo waits on the disk until it has had its turn. It outlives the engine, a
//   failed disk and a power cut, has its turn once, and goes where it is cancelled or its
//   contributor is removed.
// Method: photos of one rendered street; engines that are closed while photos wait, a disk that
//   fails, and uploads put where a power cut would have left them.
#include <gtest/gtest.h>

#include "tests/engine/street_fixture.h"
#include "tests/storage/byte_windows.h"
#include "tests/storage/fault_file_system.h"

namespace veduta {
namespace {

std::vector<Stand> Stands() {
  return Walk(6, 0.9, 5);
}

std::vector<UploadAnswer> Waiting(const City& city) {
  auto uploads = city.Ask().door().Uploads();
  EXPECT_OK(uploads);
  return uploads.ok() ? *std::move(uploads) : std::vector<UploadAnswer>();
}

// A photo as it lies on the disk while it waits.
void PutOnDisk(City* city, const Stand& stand, const std::string& contributor) {
  const TakenPhoto& photo = TakePhoto(stand);
  UploadRecord upload;
  upload.name = photo.name;
  upload.contributor = contributor;
  upload.camera = "street";
  upload.photo = HashContent(photo.jpeg);
  upload.size_bytes = photo.jpeg.size();
  ASSERT_OK(city->parts().database->AddUpload(upload, photo.jpeg));
}

TEST(Uploads, OutliveTheEngine) {
  CityOptions options = City::Options(2);
  options.settle_each = true;
  City city(options), list(options);
  for (const Stand& stand : Stands()) PutOnDisk(&city, stand, "anna");
  EXPECT_EQ(city.Counts().uploads, 5u);
  city.Reopen();
  const std::vector<UploadAnswer> waiting = Waiting(city);
  ASSERT_EQ(waiting.size(), 5u);
  EXPECT_EQ(waiting[1].number, 2u);
  EXPECT_EQ(waiting[1].name, TakePhoto(Stands()[1]).name);
  EXPECT_EQ(waiting[1].photo, HashContent(TakePhoto(Stands()[1]).jpeg).Hex());
  EXPECT_EQ(city.Counts().images, 0u) << "nothing is placed before it is resumed";
  std::vector<Ticket> tickets;
  for (const UploadAnswer& upload : waiting) {
    const auto ticket = city.engine().Resume(upload.number);
    ASSERT_OK(ticket);
    EXPECT_EQ(ticket->number(), upload.number);
    tickets.push_back(*ticket);
  }
  for (const Ticket& ticket : tickets) EXPECT_OK(ticket.Wait());
  ASSERT_OK(city.engine().Settle());
  EXPECT_TRUE(Waiting(city).empty());
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  list.Add(Stands());
  EXPECT_EQ(city.Digest(), list.Digest());
}

TEST(Uploads, WhatAClosedEngineHasNotPlacedWaitsOn) {
  City city;
  std::vector<Ticket> tickets;
  for (const Stand& stand : Stands()) tickets.push_back(*city.engine().Submit(city.Submit(stand)));
  city.Close();
  size_t placed = 0;
  for (const Ticket& ticket : tickets) placed += ticket.Wait().ok();
  city.Open();
  EXPECT_EQ(city.Counts().images, placed);
  EXPECT_EQ(Waiting(city).size(), tickets.size() - placed);
}

TEST(Uploads, AreInLineOnce) {
  City city;
  std::optional<Writer::Turn> turn = city.parts().writer->Take();
  const auto ticket = city.engine().Submit(city.Submit(Stands()[0]));
  ASSERT_OK(ticket);
  EXPECT_EQ(city.engine().Resume(ticket->number()).status().code(), StatusCode::kAlreadyExists);
  EXPECT_EQ(city.engine().Resume(77).status().code(), StatusCode::kNotFound);
  turn.reset();
  ASSERT_OK(ticket->Wait());
  EXPECT_EQ(city.engine().Resume(ticket->number()).status().code(), StatusCode::kNotFound);
}

// A kill may come between a photo's commit and the deletion of its upload, which is not synced, so
// that a power cut may bring it back as well.
TEST(Uploads, ThatHaveHadTheirTurnHaveNoSecondOneAndTellOfIt) {
  City city;
  const AddOutcome first = city.Add({Stands()[0]})[0];
  PutOnDisk(&city, Stands()[0], "anna");
  PutOnDisk(&city, Stands()[0], "bela");
  Result<AddOutcome> heard = Status::Cancelled("not told");
  const auto ticket = city.engine().Resume(1, [&](const auto& outcome) { heard = outcome; });
  ASSERT_OK(ticket);
  EXPECT_TRUE(ticket->IsDone());
  for (const Result<AddOutcome>& told : {heard, ticket->Wait()}) {
    ASSERT_OK(told);
    EXPECT_FALSE(told->duplicate) << "it is the photo itself";
    EXPECT_EQ(told->id, first.id);
    EXPECT_EQ(told->name, first.name);
    EXPECT_EQ(told->verdict, first.verdict);
    EXPECT_EQ(told->reason, first.reason);
    EXPECT_EQ(told->reconstruction, first.reconstruction);
  }
  EXPECT_EQ(city.Counts().images, 1u);
  EXPECT_EQ(city.engine().Resume(1).status().code(), StatusCode::kNotFound);
  const auto copy = city.engine().Resume(2);
  ASSERT_OK(copy);
  const Result<AddOutcome> outcome = copy->Wait();
  ASSERT_OK(outcome);
  EXPECT_TRUE(outcome->duplicate) << "the same photo, sent by somebody else";
  EXPECT_TRUE(Waiting(city).empty());
}

TEST(Uploads, GoWhenTheyAreCancelled) {
  City city;
  std::optional<Writer::Turn> turn = city.parts().writer->Take();
  std::vector<Ticket> tickets;
  for (const Stand& stand : Stands()) tickets.push_back(*city.engine().Submit(city.Submit(stand)));
  EXPECT_TRUE(tickets.back().Cancel());
  turn.reset();
  for (const Ticket& ticket : tickets) {
    EXPECT_EQ(ticket.Wait().ok(), ticket.number() != tickets.back().number());
  }
  ASSERT_OK(city.engine().Settle());
  city.Reopen();
  EXPECT_TRUE(Waiting(city).empty());
  EXPECT_EQ(city.Counts().images, 4u);
}

TEST(Uploads, WaitOnWhereTheDiskFails) {
  const auto disk = std::make_shared<FaultFileSystem>();
  CityOptions options = City::Options(2);
  options.database.sync_wal = true;
  options.database.file_system = disk;
  City city(options);
  std::optional<Writer::Turn> turn = city.parts().writer->Take();
  const auto ticket = city.engine().Submit(city.Submit(Stands()[0]));
  ASSERT_OK(ticket);
  disk->FailWrites(1, Fault::kIoError, 1000);
  turn.reset();
  EXPECT_EQ(ticket->Wait().status().code(), StatusCode::kIoError);
  EXPECT_EQ(city.engine().Submit(city.Submit(Stands()[1])).status().code(), StatusCode::kIoError)
      << "what cannot be stored is refused";
  disk->Heal();
  ASSERT_OK(city.engine().Reopen());
  ASSERT_EQ(Waiting(city).size(), 1u);
  const auto again = city.engine().Resume(Waiting(city)[0].number);
  ASSERT_OK(again);
  EXPECT_OK(again->Wait());
  EXPECT_EQ(city.Counts().images, 1u);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

TEST(Uploads, AFileIsReadWhenItIsSubmitted) {
  City city;
  PhotoSubmission absent = city.Submit("absent.jpg", {});
  absent.photo.bytes.reset();
  absent.photo.path = city.path() + "/none.jpg";
  EXPECT_EQ(city.engine().Submit(absent).status().code(), StatusCode::kNotFound);
  EXPECT_TRUE(Waiting(city).empty());
}

TEST(Uploads, ACameraThatWasLostIsSought) {
  City city;
  city.Add(Stands());
  const TakenPhoto& photo = TakePhoto(Stands()[0]);
  UploadRecord upload;
  upload.name = "again.jpg";
  upload.contributor = "anna";
  upload.camera = "lost";
  upload.photo = HashContent(photo.jpeg);
  ASSERT_OK(city.parts().database->AddUpload(upload, photo.jpeg));
  const auto ticket = city.engine().Resume(1);
  ASSERT_OK(ticket);
  const auto outcome = ticket->Wait();
  ASSERT_OK(outcome);
  EXPECT_TRUE(outcome->duplicate);
}

TEST(Uploads, GoWithTheirContributor) {
  City city;
  PutOnDisk(&city, Stands()[0], "anna");
  PutOnDisk(&city, Stands()[1], "bela");
  ByteWindows windows;
  windows.Add(std::span(TakePhoto(Stands()[0]).jpeg).subspan(2000));  // tables are in all photos
  ASSERT_FALSE(windows.FilesWithOne(city.path()).empty());
  RemoveRequest request;
  request.contributor = "anna";
  const auto answer = city.engine().Remove(request);
  ASSERT_OK(answer);
  EXPECT_OK(answer->purged);
  EXPECT_EQ(answer->uploads, 1u);
  EXPECT_TRUE(answer->removed.empty());
  EXPECT_EQ(windows.FilesWithOne(city.path()), std::vector<std::string>());
  ASSERT_EQ(Waiting(city).size(), 1u);
  EXPECT_EQ(Waiting(city)[0].contributor, "bela");
}

TEST(Uploads, InLineGoWithTheirContributorToo) {
  City city;
  std::vector<Ticket> tickets;
  for (const Stand& stand : Stands()) tickets.push_back(*city.engine().Submit(city.Submit(stand)));
  RemoveRequest request;
  request.contributor = "anna";
  const auto answer = city.engine().Remove(request);
  ASSERT_OK(answer);
  EXPECT_EQ(answer->uploads + answer->removed.size(), tickets.size());
  EXPECT_TRUE(Waiting(city).empty());
  ASSERT_OK(city.engine().Settle());
  EXPECT_EQ(city.Counts().images, 0u);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

}  // namespace
}  // namespace veduta
