// SPDX-License-Identifier: Apache-2.0
// Goal: submitters take turns, one photo each, whoever came first and however many each has; within
//   a lane the order of submission stays; a ticket tells what became of its photo.
// Method: lines of known lanes are emptied and the order compared with the one written down here.
#include "engine/schedule/submission_line.h"

#include <gtest/gtest.h>

#include <string>

namespace veduta {
namespace {

Ticket Join(SubmissionLine* line, const std::shared_ptr<Lane>& lane, const std::string& name,
            const std::string& contributor) {
  if (lane) return line->Join(lane, PhotoSource{name, {}, {}}, {}, contributor);
  static uint64_t last_number = 0;
  WaitingPhoto photo;
  photo.photo.name = name;
  photo.contributor = contributor;
  return line->Join(++last_number, std::move(photo));
}

std::string TakeAll(SubmissionLine* line) {
  std::string names;
  for (WaitingPhoto photo; line->Take(&photo);) names += photo.photo.name + " ";
  return names;
}

TEST(SubmissionLine, ContributorsTakeTurns) {
  SubmissionLine line;
  for (const char* name : {"a1", "a2", "a3", "a4"}) Join(&line, nullptr, name, "anna");
  Join(&line, nullptr, "b1", "bela");
  for (const char* name : {"c1", "c2"}) Join(&line, nullptr, name, "cara");
  EXPECT_FALSE(line.is_empty());
  EXPECT_EQ(TakeAll(&line), "a1 b1 c1 a2 c2 a3 a4 ");
  EXPECT_TRUE(line.is_empty());
}

TEST(SubmissionLine, WhoComesLateWaitsForOneOfEach) {
  SubmissionLine line;
  for (int i = 1; i <= 5; ++i) Join(&line, nullptr, "a" + std::to_string(i), "anna");
  WaitingPhoto first;
  ASSERT_TRUE(line.Take(&first));
  Join(&line, nullptr, "b1", "bela");
  EXPECT_EQ(TakeAll(&line), "a2 b1 a3 a4 a5 ");
}

TEST(SubmissionLine, AListIsALaneOfItsOwnAndKeepsItsOrder) {
  SubmissionLine line;
  const std::shared_ptr<Lane> list = line.OpenList({});
  Join(&line, list, "l1", "anna");
  Join(&line, list, "l2", "bela");
  Join(&line, nullptr, "a1", "anna");
  Join(&line, nullptr, "a2", "anna");
  Join(&line, list, "l3", "anna");
  EXPECT_EQ(TakeAll(&line), "l1 a1 l2 a2 l3 ");
}

TEST(SubmissionLine, LanesOfContributorsSettleWhereTheyAreToldToAndAreNoLists) {
  for (const bool settles : {false, true}) {
    SubmissionLine line(settles);
    Join(&line, nullptr, "a1", "anna");
    WaitingPhoto photo;
    EXPECT_FALSE(line.Take(&photo, /*of_lists=*/true, /*of_contributors=*/false));
    ASSERT_TRUE(line.Take(&photo, /*of_lists=*/false, /*of_contributors=*/true));
    EXPECT_EQ(photo.lane->settles, settles);
    EXPECT_FALSE(photo.lane->is_list);
  }
}

TEST(SubmissionLine, ListsAndContributorsArePassedOverWhereNotWanted) {
  SubmissionLine line;
  const std::shared_ptr<Lane> list = line.OpenList({});
  Join(&line, list, "l1", "anna");
  Join(&line, nullptr, "a1", "anna");
  WaitingPhoto photo;
  EXPECT_FALSE(line.Take(&photo, false, false));
  ASSERT_TRUE(line.Take(&photo, false, true));
  EXPECT_EQ(photo.photo.name, "a1");
  EXPECT_FALSE(line.Take(&photo, false, true));
  ASSERT_TRUE(line.Take(&photo, true, false));
  EXPECT_EQ(photo.photo.name, "l1");
}

TEST(SubmissionLine, TicketsAreNumberedAndCancelled) {
  SubmissionLine line;
  Ticket first = Join(&line, nullptr, "a1", "anna"), second = Join(&line, nullptr, "a2", "anna");
  EXPECT_EQ(second.number(), first.number() + 1) << "as they were given";
  EXPECT_FALSE(first.IsDone());
  EXPECT_TRUE(first.Cancel());
  EXPECT_TRUE(first.IsDone());
  EXPECT_FALSE(first.Cancel()) << "once is enough";
  EXPECT_EQ(first.Wait().status().code(), StatusCode::kCancelled);
  EXPECT_FALSE(second.IsDone());
}

TEST(SubmissionLine, ATicketOfNoSubmissionSaysSo) {
  Ticket none;
  EXPECT_EQ(none.number(), 0u);
  EXPECT_FALSE(none.IsDone());
  EXPECT_FALSE(none.Cancel());
  EXPECT_EQ(none.Wait().status().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace veduta
