// SPDX-License-Identifier: Apache-2.0
// Goal: what is hidden is in no answer to those who may not see it, whatever they ask and by
//   whatever they name it, and stays where it is in the map; reports are kept, and resolved by what
//   becomes of their photos; a link for a part of the city shows no more than that.
// Method: photos of a street, asked with and without a sight of what is hidden; the engine closed
//   and opened between.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

constexpr Sight kPublic{.sees_hidden = false};

HideRequest Photos(std::vector<std::string> photos) {
  return {std::move(photos), 0, "kai", "it shows a home"};
}

class ModerationTest : public testing::Test {
 protected:
  ModerationTest() {
    city_.Add(stands_);
    EXPECT_OK(city_.engine().Settle());
  }

  std::string NameOf(size_t i) const { return TakePhoto(stands_[i]).name; }
  Questions Public() { return city_.engine().Ask(kPublic); }

  // The names in lists and neighbours that may be told.
  std::vector<std::string> ToldNames(const Questions& ask) {
    std::vector<std::string> names;
    const auto listed = ask.Images(ImageId(1), 100);
    EXPECT_OK(listed);
    for (const ListedImage& image : *listed) {
      names.push_back(image.name);
      const auto neighbors = ask.Neighbors("#" + std::to_string(image.id.value));
      EXPECT_OK(neighbors);
      for (const NeighborAnswer& neighbor : *neighbors) names.push_back(neighbor.name);
    }
    const auto found = ask.SearchPhotos({});
    EXPECT_OK(found);
    for (const FoundPhoto& photo : found->photos) names.push_back(photo.name);
    return names;
  }
  static size_t Count(const std::vector<std::string>& names, const std::string& name) {
    return static_cast<size_t>(std::ranges::count(names, name));
  }

  const std::vector<Stand> stands_ = Walk(6, 0.9, 5);
  City city_;
};

TEST_F(ModerationTest, WhatIsHiddenIsInNoAnswerButTheMapStays) {
  const std::string digest = city_.Digest(), name = NameOf(1);
  const std::string sha256 = city_.engine().Ask().Image(name)->sha256;
  const auto before = city_.Counts();
  EXPECT_GT(Count(ToldNames(Public()), name), 2u);
  ASSERT_OK(city_.engine().Hide(Photos({name})));
  ASSERT_OK(city_.engine().Hide(Photos({"#2"}))) << "once more changes nothing";
  city_.Reopen();
  EXPECT_EQ(city_.Digest(), digest);
  EXPECT_TRUE(IsSound(city_.Ask().snapshot()));
  EXPECT_EQ(city_.Counts().placed, before.placed);
  EXPECT_EQ(city_.Counts().reconstructions.front().points, before.reconstructions.front().points);
  EXPECT_EQ(Count(ToldNames(Public()), name), 0u);
  for (const std::string& text :
       {name, std::string("#2"), "anna/" + name, sha256, sha256.substr(0, 8)}) {
    const std::string none = "there is no image '" + text + "' in the database";
    EXPECT_EQ(Public().Image(text).status().message(), none);
    EXPECT_EQ(Public().Thumbnail(text, 64).status().message(), none);
    EXPECT_EQ(Public().Photo(text).status().message(), none);
    EXPECT_EQ(Public().Neighbors(text).status().message(), none);
    EXPECT_EQ(Public().Uncertainty(text).status().message(), none);
    EXPECT_TRUE(city_.engine().Ask().Image(text)->is_hidden);
  }
  EXPECT_GT(Count(ToldNames(city_.engine().Ask()), name), 2u) << "curators see it";
  const auto hidden = city_.engine().Ask().Hidden();
  ASSERT_OK(hidden);
  ASSERT_EQ(hidden->size(), 1u);
  EXPECT_EQ(hidden->front().name, name);
  EXPECT_EQ(hidden->front().actor, "kai");
  EXPECT_EQ(hidden->front().reason, "it shows a home");
  ASSERT_OK(city_.engine().Unhide(Photos({name})));
  EXPECT_GT(Count(ToldNames(Public()), name), 2u);
  EXPECT_EQ(city_.engine().Unhide(Photos({name})).message(), "image 2 is not hidden");
}

TEST_F(ModerationTest, NeitherByTheSameBytesNorByWhatAPoseRestsOn) {
  const std::string name = NameOf(2);
  ASSERT_OK(city_.engine().Hide(Photos({name})));
  LocalizeRequest same{{"again.jpg", "", TakePhoto(stands_[2]).jpeg}, "street"};
  LocalizeRequest other{{"other.jpg", "", TakePhoto(stands_[2], 2).jpeg}, "street"};
  const LocalizeRequest both[] = {same, other};
  for (const bool sees_hidden : {true, false}) {
    std::vector<LocalizedPhoto> told;
    const Sight sight{.sees_hidden = sees_hidden};
    ASSERT_OK(city_.engine().Ask(sight).Localize(
        both, [&](const LocalizedPhoto& photo) { told.push_back(photo); }));
    ASSERT_EQ(told.size(), 2u);
    EXPECT_EQ(told[0].stored.valid(), sees_hidden);
    EXPECT_EQ(told[0].detail.find(name) != std::string::npos, sees_hidden);
    ASSERT_TRUE(told[1].cam_from_world) << told[1].detail;
    EXPECT_FALSE(told[1].support.empty());
    EXPECT_EQ(std::ranges::count(told[1].support, name, &SupportAnswer::name), sees_hidden ? 1 : 0);
    const auto ranked = city_.engine().Ask(sight).Rank(other.photo, "street", 20);
    ASSERT_OK(ranked);
    EXPECT_EQ(std::ranges::count(*ranked, name, &NeighborAnswer::name), sees_hidden ? 1 : 0);
  }
  const AddOutcome again = city_.AddOne("again.jpg", TakePhoto(stands_[2]).jpeg);
  EXPECT_TRUE(again.duplicate);
  EXPECT_NE(city_.engine().Ask().Told(again)->detail.find(name), std::string::npos);
  const auto told = Public().Told(again);
  ASSERT_OK(told);
  EXPECT_FALSE(told->id.valid());
  EXPECT_EQ(told->detail, "the same bytes are stored");
}

TEST_F(ModerationTest, TheJournalTellsOthersNoMoreThanThatSomethingWasDone) {
  ASSERT_OK(city_.engine().Hide(Photos({"#3"})));
  const auto all = city_.engine().Ask().Journal(1, 1000), told = Public().Journal(1, 1000);
  ASSERT_OK(all);
  ASSERT_OK(told);
  ASSERT_EQ(all->size(), told->size()) << "nobody who follows misses an entry";
  EXPECT_EQ(all->back().action, "hide");
  EXPECT_EQ(all->back().actor, "kai");
  EXPECT_EQ(all->back().image, ImageId(3));
  EXPECT_EQ(all->back().detail, "image 3: it shows a home");
  size_t masked = 0;
  for (size_t i = 0; i < all->size(); ++i) {
    const JournalAnswer &entry = all->at(i), &seen = told->at(i);
    EXPECT_EQ(seen.sequence, entry.sequence);
    EXPECT_EQ(seen.action, entry.action);
    const bool is_hidden = entry.image == ImageId(3);
    EXPECT_EQ(seen.actor, is_hidden ? "" : entry.actor);
    EXPECT_EQ(seen.detail, is_hidden ? "" : entry.detail);
    if (is_hidden) ++masked;
  }
  EXPECT_GE(masked, 2u);
  // Who had sent it stays hidden when it is removed.
  ASSERT_OK(city_.engine().Remove({{"#3"}, "", 0, "kai", ""}));
  const auto after = Public().Journal(1, 1000);
  ASSERT_OK(after);
  for (size_t i = 0; i < all->size(); ++i) EXPECT_EQ(after->at(i).actor, told->at(i).actor);
  EXPECT_TRUE(IsSound(city_.Ask().snapshot()));
}

TEST_F(ModerationTest, AContributionIsHiddenWithAllThatComes) {
  const auto opened = city_.engine().OpenContribution({"bela", "secret", "CC0", "bela"});
  ASSERT_OK(opened);
  const std::vector<Stand> more = Walk(10.5, 0.9, 2);
  const auto send = [&](const Stand& stand) {
    PhotoSubmission photo = city_.Submit(stand);
    photo.contributor = "bela";
    photo.contribution = *opened;
    const Result<Ticket> ticket = city_.engine().Submit(std::move(photo));
    EXPECT_OK(ticket);
    EXPECT_OK(ticket->Wait());
  };
  send(more[0]);
  HideRequest all;
  all.contribution = *opened;
  all.actor = "kai";
  ASSERT_OK(city_.engine().Hide(all));
  send(more[1]);
  for (const Stand& stand : more) {
    EXPECT_FALSE(Public().Image(TakePhoto(stand).name).ok());
    EXPECT_TRUE(city_.engine().Ask().Image(TakePhoto(stand).name)->is_hidden);
  }
  EXPECT_EQ(Public().Contribution(*opened).status().code(), StatusCode::kNotFound);
  EXPECT_TRUE(Public().Contributions(1, 10)->empty());
  EXPECT_FALSE(Public().ContributedPhotos(*opened, 1, 10).ok());
  EXPECT_TRUE(city_.engine().Ask().Contribution(*opened)->is_hidden);
  const auto told = Public().Journal(1, 1000);
  ASSERT_OK(told);
  for (const JournalAnswer& entry : *told) {
    EXPECT_NE(entry.actor, "bela") << entry.sequence << " " << entry.action;
  }
  const std::string first = TakePhoto(more[0]).name;
  EXPECT_EQ(city_.engine().Unhide(Photos({first})).message(),
            "image 6 is not hidden by itself: its contribution 1 is");
  ASSERT_OK(city_.engine().Unhide(all));
  EXPECT_OK(Public().Image(first));
  EXPECT_EQ(Public().Contribution(*opened)->contributor, "bela");
  ASSERT_OK(city_.engine().Hide(Photos({first})));
  const auto photos = Public().ContributedPhotos(*opened, 1, 10);
  ASSERT_OK(photos);
  ASSERT_EQ(photos->size(), 2u);
  EXPECT_EQ(photos->front().state, "hidden");
  EXPECT_EQ(photos->front().name, "");
  EXPECT_FALSE(photos->front().image.valid());
  EXPECT_NE(photos->back().state, "hidden");
}

TEST_F(ModerationTest, ReportsAreResolvedByWhatBecomesOfTheirPhotos) {
  const auto report = [&](const std::string& photo, const std::string& who) {
    const auto number =
        city_.engine().Report({photo, ReportReason::kPrivacy, "my\nwindow", who}, kPublic);
    EXPECT_OK(number);
    return number.ok() ? *number : 0;
  };
  EXPECT_EQ(report(NameOf(0), "vera"), 1u);
  EXPECT_EQ(report("#1", "vera"), 1u) << "one has one open report of a photo";
  EXPECT_EQ(report("#1", "anna"), 2u);
  EXPECT_EQ(report("#2", "vera"), 3u);
  EXPECT_EQ(report("#3", "vera"), 4u);
  city_.Reopen();
  Engine& anew = city_.engine();
  const auto open = anew.Ask().Reports(true);
  ASSERT_OK(open);
  ASSERT_EQ(open->size(), 4u);
  EXPECT_EQ(open->front().name, NameOf(0));
  EXPECT_EQ(open->front().text, "my\nwindow");
  EXPECT_EQ(open->front().reporter, "vera");
  ASSERT_OK(anew.DismissReport(3, "kai"));
  EXPECT_EQ(anew.DismissReport(3, "kai").code(), StatusCode::kAlreadyExists);
  EXPECT_EQ(anew.DismissReport(9, "kai").code(), StatusCode::kNotFound);
  ASSERT_OK(anew.Hide(Photos({"#1"})));
  ASSERT_OK(anew.Remove({{"#3"}, "", 0, "ada", ""}));
  EXPECT_TRUE(anew.Ask().Reports(true)->empty());
  const auto all = anew.Ask().Reports(false);
  ASSERT_OK(all);
  std::vector<std::string> fates;
  for (const ReportAnswer& one : *all)
    fates.push_back(ReportStateWord(one.state) + " by " + one.resolver);
  EXPECT_EQ(fates, (std::vector<std::string>{"hidden by kai", "hidden by kai", "dismissed by kai",
                                             "erased by ada"}));
  EXPECT_EQ(all->back().text, "") << "what was written goes with the photo";
  EXPECT_EQ(all->back().name, "");
  EXPECT_EQ(anew.Report({"#1", ReportReason::kOther, "", "vera"}, kPublic).status().code(),
            StatusCode::kNotFound)
      << "who cannot see it cannot report it";
  EXPECT_EQ(report("#2", "vera"), 5u) << "a dismissed one may be reported again";
  EXPECT_TRUE(IsSound(city_.Ask().snapshot()));
  for (const std::string& text : {std::string(2001, 'x'), std::string("a\0b", 3)}) {
    EXPECT_EQ(anew.Report({"#2", ReportReason::kOther, text, "v"}).status().code(),
              StatusCode::kInvalidArgument);
    EXPECT_EQ(anew.Hide({{"#2"}, 0, "kai", text}).code(), StatusCode::kInvalidArgument);
  }
  EXPECT_EQ(anew.Hide({}).code(), StatusCode::kInvalidArgument);
}

TEST_F(ModerationTest, APartShowsNoMoreThanItself) {
  const auto opened = city_.engine().OpenContribution({"anna", "", "", "anna"});
  ASSERT_OK(opened);
  PhotoSubmission photo = city_.Submit(Walk(10.5, 0.9, 1)[0]);
  const std::string name = photo.photo.name;
  photo.contribution = *opened;
  const Result<Ticket> ticket = city_.engine().Submit(std::move(photo));
  ASSERT_OK(ticket);
  ASSERT_OK(ticket->Wait());
  const Questions part = city_.engine().Ask({.sees_hidden = false, .contribution = *opened});
  const std::vector<std::string> names = ToldNames(part);
  EXPECT_EQ(Count(names, name), names.size());
  EXPECT_EQ(names.size(), 2u);
  EXPECT_FALSE(part.Image(NameOf(0)).ok());
  EXPECT_EQ(part.Contributions(1, 10)->size(), 1u);
  const ReconstructionId id = part.Image(name)->reconstruction;
  ASSERT_TRUE(id.valid());
  EXPECT_OK(part.Points(id));
  EXPECT_EQ(part.Reconstructions()->size(), 1u);
  const Questions one = city_.engine().Ask({.sees_hidden = false, .reconstruction = id});
  EXPECT_EQ(one.Images(ImageId(1), 100)->size(), city_.Counts().placed);
  EXPECT_OK(one.Points(id));
  EXPECT_FALSE(one.Contribution(*opened).ok());
  ASSERT_OK(city_.engine().Hide(Photos({name})));
  EXPECT_TRUE(city_.engine()
                  .Ask({.sees_hidden = false, .contribution = *opened})
                  .Images(ImageId(1), 100)
                  ->empty());
  for (const JournalAnswer& entry : *part.Journal(1, 1000)) {
    if (entry.action == "add" && entry.image != part.Image(name)->id) {
      EXPECT_EQ(entry.actor, "");
    }
  }
}

TEST_F(ModerationTest, WhatTokensHaveUsedOutlivesTheEngine) {
  const TokenUse uses[] = {{0, 5, 0, 0, 3}, {7, 6, 1.5, 1e9, 0}};
  ASSERT_OK(city_.engine().NoteTokenUse(uses));
  const std::string digest = city_.Digest();
  city_.Reopen();
  const auto known = city_.engine().Ask().TokenUses();
  ASSERT_OK(known);
  ASSERT_EQ(known->size(), 2u);
  EXPECT_EQ(known->at(0).reports, 3);
  EXPECT_EQ(known->at(1).token, 7u);
  EXPECT_EQ(known->at(1).bytes, 1e9);
  EXPECT_EQ(city_.Digest(), digest);
  EXPECT_TRUE(IsSound(city_.Ask().snapshot()));
}

}  // namespace
}  // namespace veduta
