// SPDX-License-Identifier: Apache-2.0
// Goal: nobody fills a budget alone by many shares, and what is given back is there for others.
// Method: shares of a few askers, in turn and by threads at once.
#include "cli/service/divided_budget.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace veduta {
namespace {

TEST(DividedBudget, OneLeavesHalfOfItToOthers) {
  const auto budget = std::make_shared<DividedBudget>(100);
  DividedShare first(budget, "anna"), second(budget, "anna"), other(budget, "ben");
  EXPECT_TRUE(first.Grow(30));
  EXPECT_TRUE(second.Grow(20));
  EXPECT_FALSE(second.Grow(21)) << "she has half";
  EXPECT_EQ(second.taken(), 20u);
  EXPECT_FALSE(first.Grow(31));
  EXPECT_TRUE(other.Grow(50)) << "one share alone may be more than half of what there is";
  EXPECT_FALSE(other.Grow(51)) << "but there is no more";
  {
    DividedShare third(budget, "clara");
    EXPECT_FALSE(third.Grow(1));
    EXPECT_TRUE(other.Grow(40)) << "a share may become smaller";
    EXPECT_TRUE(third.Grow(10));
  }
  EXPECT_TRUE(other.Grow(50)) << "the third share was given back";
}

TEST(DividedBudget, AShareAloneMayBeAllOfIt) {
  const auto budget = std::make_shared<DividedBudget>(100);
  {
    DividedShare whole(budget, "anna"), next(budget, "anna");
    EXPECT_TRUE(whole.Grow(100));
    EXPECT_FALSE(whole.Grow(101));
    EXPECT_FALSE(next.Grow(1));
  }
  DividedShare again(budget, "anna"), beside(budget, "anna");
  EXPECT_TRUE(again.Grow(60));
  EXPECT_FALSE(beside.Grow(1)) << "who has more than half by one has no other";
}

TEST(DividedBudget, WhoHasNoNameHasWhatThereIs) {
  const auto budget = std::make_shared<DividedBudget>(10);
  std::vector<std::unique_ptr<DividedShare>> shares;
  for (int i = 0; i < 10; ++i) {
    shares.push_back(std::make_unique<DividedShare>(budget));
    EXPECT_TRUE(shares.back()->Grow(1)) << i;
  }
  DividedShare more(budget);
  EXPECT_FALSE(more.Grow(1));
  shares.pop_back();
  EXPECT_TRUE(more.Grow(1));
}

TEST(DividedBudget, OfPlacesOneHasHalf) {
  const auto budget = std::make_shared<DividedBudget>(11);
  std::vector<std::unique_ptr<DividedShare>> places;
  const auto count = [&](const std::string& asker) {
    uint32_t taken = 0;
    for (int i = 0; i < 20; ++i) {
      places.push_back(std::make_unique<DividedShare>(budget, asker));
      taken += places.back()->Grow(1);
    }
    return taken;
  };
  EXPECT_EQ(count("anna"), 5u);
  EXPECT_EQ(count("ben"), 5u);
  EXPECT_FALSE(budget->is_full());
  EXPECT_EQ(count("clara"), 1u);
  EXPECT_TRUE(budget->is_full());
  const auto only = std::make_shared<DividedBudget>(1);
  DividedShare first(only, "anna"), second(only, "anna");
  EXPECT_TRUE(first.Grow(1));
  EXPECT_FALSE(second.Grow(1));
}

TEST(DividedBudget, AShareIsNamedBeforeItGrows) {
  const auto budget = std::make_shared<DividedBudget>(10);
  DividedShare first(budget), second(budget);
  first.Name("anna");
  second.Name("anna");
  EXPECT_TRUE(first.Grow(3));
  EXPECT_FALSE(second.Grow(3));
  EXPECT_TRUE(second.Grow(2));
}

TEST(DividedBudget, ThreadsLeaveNothingBehind) {
  const auto budget = std::make_shared<DividedBudget>(1'000);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&budget, name = std::string(t % 2 == 0 ? "anna" : "ben")] {
      for (uint64_t i = 1; i <= 2'000; ++i) {
        DividedShare share(budget, name);
        share.Grow(i % 300);
        share.Grow(i % 400);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  DividedShare whole(budget, "anna");
  EXPECT_TRUE(whole.Grow(1'000));
}

}  // namespace
}  // namespace veduta
