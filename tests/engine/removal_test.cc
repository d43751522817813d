// SPDX-License-Identifier: Apache-2.0
// Goal: the door removes photos, finishes what a killed removal has left, refuses what it must, and
//   a photo that waits in line while a copy of it is removed is stored whole. A vocabulary that was
//   prepared before a removal knows nothing of the photo. Callbacks may use the engine.
// Method: photos of a synthetic street; a copy is prepared before its original is added or removed,
//   by the parts behind the door; invariants are checked after each step.
#include <gtest/gtest.h>

#include <algorithm>

#include "street_fixture.h"
#include "tests/storage/byte_windows.h"

namespace veduta {
namespace {

const std::vector<Stand>& Stands() {
  static const std::vector<Stand> stands = Walk(2, 0.8, 6);
  return stands;
}

void RemoveBehindTheDoor(City* city, uint32_t id) {
  Writer::Turn turn = city->parts().writer->Take();
  ASSERT_OK(city->parts().ingest->Remove(ImageId(id), "bea", ""));
}

// What Apply says of the stand's photo as it was prepared, and then of one prepared anew.
void ExpectPreparedAnew(City* city, const Stand& stand, Result<PreparedPhoto> prepared) {
  ASSERT_OK(prepared);
  const CameraRecord camera = *city->parts().FindCamera("street");
  Writer::Turn turn = city->parts().writer->Take();
  const auto outdated = city->parts().ingest->Apply(std::move(*prepared), camera, "anna");
  ASSERT_OK(outdated);
  EXPECT_EQ(outdated->failure.code(), StatusCode::kBusy);
  EXPECT_FALSE(outdated->id.valid());
  auto again = city->parts().preparer->Prepare(city->Submit(stand).photo, camera.model, "anna");
  ASSERT_OK(again);
  const auto outcome = city->parts().ingest->Apply(std::move(*again), camera, "anna");
  ASSERT_OK(outcome);
  EXPECT_OK(outcome->failure);
  EXPECT_TRUE(outcome->id.valid());
}

TEST(Removal, APhotoThatWasKnownWhenItWasPreparedIsPreparedAnew) {
  City city;
  city.Add(Stands());
  auto known =
      city.parts().preparer->Prepare(city.Submit(Stands()[2]).photo, StreetCameraModel(), "anna");
  ASSERT_OK(known);
  ASSERT_TRUE(known->known);
  RemoveBehindTheDoor(&city, 3);
  ExpectPreparedAnew(&city, Stands()[2], std::move(known));
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

TEST(Removal, APhotoWhoseCopyCameAndWentIsPreparedAnew) {
  City city;
  auto early =
      city.parts().preparer->Prepare(city.Submit(Stands()[2]).photo, StreetCameraModel(), "anna");
  ASSERT_OK(early);
  ASSERT_FALSE(early->known);
  city.Add(Stands());
  RemoveBehindTheDoor(&city, 3);
  ExpectPreparedAnew(&city, Stands()[2], std::move(early));
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

TEST(Removal, APhotoInLineIsStoredWhole) {
  City city;
  city.Add(Stands());
  std::optional<Writer::Turn> turn = city.parts().writer->Take();
  const Result<Ticket> ticket = city.engine().Submit(city.Submit(Stands()[2]));
  ASSERT_OK(ticket);
  ASSERT_OK(city.parts().ingest->Remove(ImageId(3), "bea", ""));
  turn.reset();
  const Result<AddOutcome> outcome = ticket->Wait();
  ASSERT_OK(outcome);
  EXPECT_EQ(outcome->id, ImageId(7));
  ASSERT_OK(city.engine().Settle());
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

TEST(Removal, SettleFinishesWhatAKilledOneHasLeft) {
  City city;
  city.Add(Stands());
  ByteWindows windows;
  windows.Add(std::span(TakePhoto(Stands()[1]).jpeg).subspan(2000));  // tables are in all photos
  RemoveBehindTheDoor(&city, 2);
  ASSERT_FALSE(windows.FilesWithOne(city.path()).empty());
  city.Reopen();
  EXPECT_TRUE(city.Ask().snapshot().GetState()->removed_bytes_left);
  ASSERT_OK(city.engine().Settle());
  EXPECT_FALSE(city.Ask().snapshot().GetState()->removed_bytes_left);
  EXPECT_EQ(windows.FilesWithOne(city.path()), std::vector<std::string>());
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

TEST(Removal, IsOfEachPhotoOnceInTheOrderOfTheRequest) {
  City city;
  city.Add(Stands());
  RemoveRequest request;
  request.photos = {"#4", TakePhoto(Stands()[0]).name, "#1"};
  request.actor = "bea";
  request.why = "asked by mail";
  std::vector<ImageId> told;
  const auto answer = city.engine().Remove(
      request, {}, [&](const RemovedPhoto& photo) { told.push_back(photo.image); });
  ASSERT_OK(answer);
  EXPECT_OK(answer->purged);
  EXPECT_EQ(told, (std::vector{ImageId(4), ImageId(1)}));
  EXPECT_EQ(answer->removed.size(), 2u);
  EXPECT_TRUE(answer->copies.empty());
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  std::vector<JournalRecord> entries;
  ASSERT_OK(city.Ask().snapshot().ScanJournal(1, [&](const JournalRecord& entry) {
    if (entry.action == "remove") entries.push_back(entry);
    return true;
  }));
  ASSERT_EQ(entries.size(), 2u);
  EXPECT_EQ(entries[0].actor, "bea");
  EXPECT_EQ(entries[0].detail, "asked by mail");
}

// With the turn held it would wait for itself.
TEST(Removal, ACallbackMayUseTheEngine) {
  City city;
  city.Add(Stands());
  RemoveRequest request;
  request.photos = {"#4", "#5"};
  size_t told = 0;
  const auto report = [&](const RemovedPhoto& photo) {
    ++told;
    EXPECT_OK(city.engine().AddCamera("after " + photo.name, StreetCameraModel(), "a test"));
    EXPECT_FALSE(city.engine().Ask().Image(photo.name).ok());
    EXPECT_OK(city.engine().Settle());
    EXPECT_EQ(city.engine().Remove(request).status().code(), StatusCode::kBusy);
  };
  const auto answer = city.engine().Remove(request, {}, report);
  ASSERT_OK(answer);
  EXPECT_OK(answer->purged);
  EXPECT_EQ(told, 2u);
  EXPECT_EQ(city.engine().Ask().Cameras()->size(), 3u);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

// The manifest has the first and the last key of each table, of names too.
TEST(Removal, NoFileHasTheNameAnyMore) {
  City city;
  const std::string name = "0 " + std::string(ByteWindows::kSize, 'n') + ".jpg";
  city.AddOne(name, TakePhoto(Stands()[0]).jpeg);
  city.Add({Stands()[1], Stands()[2]});
  ASSERT_OK(city.parts().database->Compact());
  ByteWindows windows;
  windows.Add({reinterpret_cast<const uint8_t*>(name.data()), name.size()});
  const std::vector<std::string> found = windows.FilesWithOne(city.path());
  EXPECT_TRUE(std::ranges::any_of(found, [](const std::string& file) {
    return file.starts_with("MANIFEST");
  })) << "the search finds what is there";
  RemoveRequest request;
  request.photos = {name};
  const auto answer = city.engine().Remove(request);
  ASSERT_OK(answer);
  EXPECT_OK(answer->purged);
  EXPECT_EQ(windows.FilesWithOne(city.path()), std::vector<std::string>());
  EXPECT_OK(city.engine().AddCamera("another", StreetCameraModel(), "a test"));
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

TEST(Removal, RefusesWhatItMust) {
  City city;
  city.Add(Stands());
  const std::string before = city.Digest();
  RemoveRequest request;
  request.photos = {"#1", "#77"};
  EXPECT_EQ(city.engine().Remove(request).status().code(), StatusCode::kNotFound);
  request.photos = {"#1"};
  request.contributor = "anna";
  EXPECT_EQ(city.engine().Remove(request).status().code(), StatusCode::kInvalidArgument);
  request.photos.clear();
  request.contributor = "annna";
  EXPECT_EQ(city.engine().Remove(request).status().code(), StatusCode::kNotFound);
  request.contributor.clear();
  request.photos = {"#1"};
  {
    const auto dense = city.parts().dense_pass.TryClaim();
    EXPECT_EQ(city.engine().Remove(request).status().code(), StatusCode::kBusy);
  }
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(city.engine().Remove(request, stop.get_token()).status().code(),
            StatusCode::kCancelled);
  EXPECT_EQ(city.Digest(), before);
}

TEST(Removal, AVocabularyThatWasPreparedBeforeKnowsNothingOfThePhoto) {
  City city;
  city.Add(Stands());
  const auto caches = city.parts().GetCaches();
  auto prepared = caches->retrieval.Train(city.parts().database.get(), city.parts().pool.get());
  ASSERT_OK(prepared);
  RemoveBehindTheDoor(&city, 2);
  ASSERT_OK(city.parts().Activate(caches, std::move(*prepared)));
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  EXPECT_EQ(city.Ask().snapshot().GetState()->images_at_vocabulary, 5u);
  RemoveBehindTheDoor(&city, 5);  // one that is known to the active vocabulary
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

TEST(Forbidding, IsAskedForByNamesOrNumbers) {
  City city;
  city.Add(Stands());
  ForbidRequest request;
  request.a = "#2";
  request.b = TakePhoto(Stands()[0]).name;
  request.actor = "bea";
  ASSERT_OK(city.engine().Forbid(request));
  const auto forbidden = city.Ask().door().Forbidden();
  ASSERT_OK(forbidden);
  ASSERT_EQ(forbidden->size(), 1u);
  EXPECT_EQ(forbidden->front().image_a, ImageId(1));
  EXPECT_EQ(forbidden->front().name_a, request.b);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  ASSERT_OK(city.engine().Allow(request));
  request.kind = ForbidKind::kMerge;
  EXPECT_EQ(city.engine().Forbid(request).code(), StatusCode::kInvalidArgument);
}

TEST(Forbidding, APoseIsAskedForByOnePhoto) {
  City city;
  city.Add(Stands());
  ForbidRequest request;
  request.kind = ForbidKind::kPose;
  request.a = TakePhoto(Stands()[2]).name;
  request.b = "#1";
  EXPECT_EQ(city.engine().Forbid(request).code(), StatusCode::kInvalidArgument);
  request.b.clear();
  const std::string before = city.Digest();
  ASSERT_TRUE(city.Ask().Pose(ImageId(3))->has_value());
  ASSERT_OK(city.engine().Forbid(request));
  ASSERT_OK(city.engine().Settle());
  EXPECT_FALSE(city.Ask().Pose(ImageId(3))->has_value());
  EXPECT_NE(city.Digest(), before);
  const auto forbidden = city.Ask().door().Forbidden();
  ASSERT_OK(forbidden);
  ASSERT_EQ(forbidden->size(), 1u);
  EXPECT_EQ(forbidden->front().kind, ForbidKind::kPose);
  EXPECT_EQ(forbidden->front().image_a, ImageId(3));
  EXPECT_EQ(forbidden->front().name_a, request.a);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  ASSERT_OK(city.engine().Allow(request));
  ASSERT_OK(city.engine().Settle());
  EXPECT_TRUE(city.Ask().Pose(ImageId(3))->has_value());
  EXPECT_EQ(city.engine().Allow(request).code(), StatusCode::kNotFound);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

}  // namespace
}  // namespace veduta
