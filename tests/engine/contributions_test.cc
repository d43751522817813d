// SPDX-License-Identifier: Apache-2.0
// Goal: a contribution tells what became of each of its photos, and of all in sum, right after; it
//   takes no other's photos, and none once it is closed; it is removed with its photos.
// Method: photos of a street, files that are none, duplicates; the engine closed and opened
//   between.
#include <gtest/gtest.h>

#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

uint32_t Open(City* city, const std::string& contributor = "anna") {
  const auto opened = city->engine().OpenContribution(
      {contributor, "a walk\nby the river", "CC BY 4.0", contributor});
  EXPECT_OK(opened);
  return opened.ok() ? *opened : 0;
}

Result<AddOutcome> SendTo(City* city, uint32_t contribution, PhotoSubmission photo) {
  photo.contribution = contribution;
  const Result<Ticket> ticket = city->engine().Submit(std::move(photo));
  return ticket.ok() ? ticket->Wait() : ticket.status();
}

std::vector<std::string> StatesOf(const City& city, uint32_t number) {
  std::vector<std::string> states;
  const auto photos = city.Ask().door().ContributedPhotos(number, 1, 1000);
  EXPECT_OK(photos);
  for (const ContributedPhotoAnswer& photo : *photos) states.push_back(photo.state);
  return states;
}

std::vector<std::string> DoneIn(const City& city) {
  std::vector<std::string> done;
  const auto entries = city.Ask().door().Journal(1, 1000);
  EXPECT_OK(entries);
  for (const JournalAnswer& entry : *entries) {
    if (entry.action == "contribution") done.push_back(entry.actor + " " + entry.detail);
  }
  return done;
}

TEST(Contributions, TellWhatBecameOfTheirPhotos) {
  City city;
  const uint32_t number = Open(&city);
  EXPECT_EQ(number, 1u);
  const std::vector<Stand> stands = Walk(6, 0.9, 4);
  for (size_t i = 0; i < 3; ++i) EXPECT_OK(SendTo(&city, number, city.Submit(stands[i])));
  PhotoSubmission again = city.Submit(stands[0]);
  again.photo.name = "again.jpg";
  EXPECT_TRUE(SendTo(&city, number, std::move(again))->duplicate);
  EXPECT_OK(SendTo(&city, number, city.Submit("none.jpg", {1, 2, 3})));
  city.Add({stands[3]});  // of none
  ASSERT_OK(city.engine().Settle());
  city.Reopen();
  const auto told = city.Ask().door().Contribution(number);
  ASSERT_OK(told);
  EXPECT_EQ(told->comment, "a walk\nby the river");
  EXPECT_EQ(told->licence, "CC BY 4.0");
  EXPECT_EQ(told->contributor, "anna");
  EXPECT_GT(told->opened_unix_s, 0);
  EXPECT_EQ(told->closed_unix_s, 0);
  EXPECT_EQ(told->photos, 5u);
  const auto sums = city.Ask().door().ContributionVerdicts(number);
  ASSERT_OK(sums);
  EXPECT_EQ(sums->placed, 3u) << "as their verdicts are now, not as they were first";
  EXPECT_EQ(sums->duplicates, 1u);
  EXPECT_EQ(sums->refused, 1u);
  EXPECT_EQ(sums->waiting + sums->arriving + sums->postponed + sums->failed + sums->removed, 0u);
  EXPECT_EQ(sums->reasons, (std::map<Reason, uint64_t>{{Reason::kUnsupportedFormat, 1}}));
  const auto photos = city.Ask().door().ContributedPhotos(number, 4, 1);
  ASSERT_OK(photos);
  ASSERT_EQ(photos->size(), 1u);
  EXPECT_EQ(photos->front().name, TakePhoto(stands[0]).name) << "that of the stored one";
  EXPECT_EQ(photos->front().state, "duplicate");
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

TEST(Contributions, PhotosThatWaitAreToldAsSuch) {
  City city;
  const uint32_t number = Open(&city);
  std::optional<Writer::Turn> turn = city.parts().writer->Take();
  PhotoSubmission photo = city.Submit(Walk(6, 0.9, 1)[0]);
  photo.contribution = number;
  const auto ticket = city.engine().Submit(std::move(photo));
  ASSERT_OK(ticket);
  const auto begun = city.engine().BeginUpload({"2.jpg", "anna", "", number, 0, 100}, {});
  ASSERT_OK(begun);
  const auto sums = city.Ask().door().ContributionVerdicts(number);
  EXPECT_EQ(sums->waiting, 1u);
  EXPECT_EQ(sums->arriving, 1u);
  EXPECT_EQ(StatesOf(city, number), std::vector<std::string>{"waiting"});
  turn.reset();
  ASSERT_OK(ticket->Wait());
  EXPECT_EQ(city.Ask().door().ContributionVerdicts(number)->waiting, 0u);
}

TEST(Contributions, TakeTheirContributorsPhotosUntilTheyAreClosed) {
  City city;
  const uint32_t number = Open(&city);
  PhotoSubmission of_bela = city.Submit("1.jpg", {1});
  of_bela.contributor = "bela";
  EXPECT_EQ(SendTo(&city, number, std::move(of_bela)).status().code(),
            StatusCode::kInvalidArgument);
  EXPECT_EQ(SendTo(&city, 7, city.Submit("1.jpg", {1})).status().code(), StatusCode::kNotFound);
  ASSERT_OK(city.engine().CloseContribution(number, "anna"));
  ASSERT_OK(city.engine().CloseContribution(number, "anna")) << "once more";
  EXPECT_EQ(SendTo(&city, number, city.Submit("1.jpg", {1})).status().code(),
            StatusCode::kAlreadyExists);
  EXPECT_EQ(city.engine().BeginUpload({"1.jpg", "anna", "", number, 0, 9}, {}).status().code(),
            StatusCode::kAlreadyExists);
  EXPECT_GT(city.Ask().door().Contribution(number)->closed_unix_s, 0);
  EXPECT_EQ(city.engine().CloseContribution(9, "anna").code(), StatusCode::kNotFound);
  EXPECT_EQ(city.Counts().uploads, 0u);
  EXPECT_EQ(DoneIn(city), (std::vector<std::string>{"anna opened 1", "anna closed 1"}));
}

TEST(Contributions, AreRemovedWithTheirPhotos) {
  City city;
  const std::vector<Stand> stands = Walk(6, 0.9, 4);
  const uint32_t first = Open(&city), second = Open(&city);
  for (size_t i = 0; i < 4; ++i)
    EXPECT_OK(SendTo(&city, i == 0 ? first : second, city.Submit(stands[i])));
  ASSERT_OK(city.engine().BeginUpload({"5.jpg", "anna", "", second, 0, 9}, {}));
  RemoveRequest removal;
  removal.photos = {"#2"};
  ASSERT_OK(city.engine().Remove(removal));
  EXPECT_EQ(StatesOf(city, second).front(), "removed");
  EXPECT_EQ(city.Ask().door().ContributedPhotos(second, 1, 1)->front().name, "");
  removal.photos.clear();
  removal.contribution = second;
  removal.actor = "kai";
  const auto removed = city.engine().Remove(removal);
  ASSERT_OK(removed);
  EXPECT_EQ(removed->removed.size(), 2u);
  EXPECT_EQ(removed->uploads, 1u);
  EXPECT_EQ(city.Counts().images, 1u);
  EXPECT_EQ(city.Ask().door().Contribution(second).status().code(), StatusCode::kNotFound);
  EXPECT_EQ(city.engine().Remove(removal).status().code(), StatusCode::kNotFound);
  EXPECT_EQ(Open(&city), 3u) << "numbers are never used again";
  EXPECT_EQ(city.Ask().door().Contributions(1, 10)->size(), 2u);
  EXPECT_EQ(city.Ask().door().Contributions(2, 10)->front().number, 3u);
  EXPECT_EQ(city.Ask().door().Contributions(1, 1)->size(), 1u);
  removal.contribution = 0;
  removal.contributor = "anna";
  ASSERT_OK(city.engine().Remove(removal));
  EXPECT_TRUE(city.Ask().door().Contributions(1, 10)->empty());
  EXPECT_EQ(DoneIn(city).back(), "kai removed 3");
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  removal.contribution = 1;
  EXPECT_EQ(city.engine().Remove(removal).status().code(), StatusCode::kInvalidArgument);
}

TEST(Contributions, TheirTextsHaveLimits) {
  const ContributionRequest good{"anna", std::string(2000, 'x'), std::string(200, 'x'), "anna"};
  EXPECT_OK(good.Check());
  ContributionRequest wrong = good;
  wrong.comment += "x";
  EXPECT_EQ(wrong.Check().code(), StatusCode::kInvalidArgument);
  wrong = good;
  wrong.licence += "x";
  EXPECT_EQ(wrong.Check().code(), StatusCode::kInvalidArgument);
  wrong = good;
  wrong.comment = "a\x1b[31m";
  EXPECT_EQ(wrong.Check().code(), StatusCode::kInvalidArgument);
  wrong = good;
  wrong.licence = "a\nb";
  EXPECT_EQ(wrong.Check().code(), StatusCode::kInvalidArgument);
  wrong = good;
  wrong.contributor.clear();
  EXPECT_EQ(wrong.Check().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace veduta
