// SPDX-License-Identifier: Apache-2.0
// Goal: a merge that the evidence does not allow is kept as a hypothesis that status, show and the
//   questions of the door tell, is judged anew by later photos, and goes when the merge is made,
//   when somebody forbids it and when its photos are removed; the same on any number of threads and
//   processes.
// Method: photos of the two ends of a synthetic street and then of what lies between, added by an
//   engine that believes no seam, and later by one that believes those that hold.
#include <gtest/gtest.h>

#include "street_fixture.h"

namespace veduta {
namespace {

CityOptions Unbelieving(uint32_t thread_count) {
  CityOptions options = City::Options(thread_count);
  options.ingest.mapper.doubt.seam_pairs_min = 1000;
  return options;
}

const std::vector<Stand>& BothEnds() {
  static const std::vector<Stand> stands = {{6, 90},    {11, 90},  {16, 90},   {8.5, 90},
                                            {20.5, 90}, {22, 95},  {23.5, 85}, {13.5, 90},
                                            {18, 90},   {19.2, 90}};
  return stands;
}

// The journal's actions, one after the other.
std::string Actions(const City& city) {
  std::string actions;
  EXPECT_OK(city.Ask().snapshot().ScanJournal(1, [&](const JournalRecord& entry) {
    actions += entry.action + " ";
    return true;
  }));
  return actions;
}

class DoubtfulSeam : public testing::Test {
 protected:
  DoubtfulSeam() : city_(Unbelieving(2)) {
    outcomes_ = city_.Add(BothEnds());
    EXPECT_EQ(city_.Counts().reconstructions.size(), 2u) << Told(outcomes_);
    const auto hypotheses = city_.engine().Ask().Hypotheses();
    EXPECT_OK(hypotheses);
    if (hypotheses.ok() && hypotheses->size() == 1) hypothesis_ = hypotheses->front();
  }

  uint64_t CountOpen() const { return city_.Counts().open_hypotheses; }

  City city_;
  std::vector<AddOutcome> outcomes_;
  HypothesisAnswer hypothesis_;
};

TEST_F(DoubtfulSeam, IsToldByTheDoor) {
  ASSERT_TRUE(hypothesis_.a.valid()) << Told(outcomes_) << Actions(city_);
  EXPECT_EQ(hypothesis_.a, ReconstructionId(1));
  EXPECT_EQ(hypothesis_.b, ReconstructionId(2));
  EXPECT_GE(hypothesis_.common_points, 20u);
  EXPECT_GE(hypothesis_.pairs_for, 1u);
  EXPECT_GE(hypothesis_.judgments, 1u);
  EXPECT_FALSE(hypothesis_.due);
  EXPECT_GT(hypothesis_.scale, 0);
  EXPECT_NE(hypothesis_.reason.find("too few pairs of photos across the seam agree"),
            std::string::npos);
  const StatusAnswer status = city_.Counts();
  EXPECT_EQ(status.open_hypotheses, 1u);
  ASSERT_EQ(status.doubtful_seams.size(), 1u);
  EXPECT_EQ(status.doubtful_seams[0].reason, hypothesis_.reason);
  const Questions ask = city_.engine().Ask();
  for (const uint32_t id : {1u, 2u}) {
    const auto of_one = ask.Hypotheses(ReconstructionId(id));
    ASSERT_OK(of_one);
    EXPECT_EQ(of_one->size(), 1u);
  }
  EXPECT_TRUE(ask.Hypotheses(ReconstructionId(3))->empty());
  for (const AddOutcome& outcome : outcomes_) {
    const auto image = ask.Image(outcome.name);
    ASSERT_OK(image);
    EXPECT_EQ(image->hypotheses.size(), image->reconstruction.valid() ? 1u : 0u) << outcome.name;
  }
  const std::string actions = Actions(city_);
  EXPECT_NE(actions.find("hypothesis"), std::string::npos);
  EXPECT_EQ(actions.find("hypothesis"), actions.rfind("hypothesis")) << "it opens once";
  EXPECT_TRUE(IsSound(city_.Ask().snapshot()));
}

TEST_F(DoubtfulSeam, IsTheSameOnAnyThreadsAndProcesses) {
  City alone(Unbelieving(1));
  for (const Stand& stand : BothEnds()) {
    alone.Add({alone.Submit(stand)});
    alone.Reopen();
  }
  EXPECT_EQ(alone.Digest(), city_.Digest());
  EXPECT_EQ(Actions(alone), Actions(city_));
  const auto hypotheses = alone.engine().Ask().Hypotheses();
  ASSERT_OK(hypotheses);
  ASSERT_EQ(hypotheses->size(), 1u);
  EXPECT_EQ(hypotheses->front().judgments, hypothesis_.judgments);
}

TEST_F(DoubtfulSeam, IsJudgedAnewByALaterPhotoAndGoesWithTheMerge) {
  ASSERT_EQ(CountOpen(), 1u);
  city_.Add({city_.Submit(Stand{14.8, 90})});
  const auto again = city_.engine().Ask().Hypotheses();
  ASSERT_OK(again);
  ASSERT_EQ(again->size(), 1u);
  EXPECT_GT(again->front().judgments, hypothesis_.judgments);
  EXPECT_EQ(again->front().image, hypothesis_.image) << "the one that proposed it";
  city_.Reopen(City::Options(2).ingest);
  city_.Add({city_.Submit(Stand{17, 90})});
  EXPECT_EQ(CountOpen(), 0u);
  EXPECT_EQ(city_.Counts().reconstructions.size(), 1u) << Actions(city_);
  EXPECT_TRUE(IsSound(city_.Ask().snapshot()));
}

TEST_F(DoubtfulSeam, GoesWhenSomebodyForbidsTheMerge) {
  ASSERT_EQ(CountOpen(), 1u);
  ASSERT_OK(city_.engine().Forbid({ForbidKind::kMerge, "2", "1", "bea", "two courtyards"}));
  EXPECT_EQ(CountOpen(), 0u);
  city_.Reopen(City::Options(2).ingest);
  city_.Add({city_.Submit(Stand{14.8, 90}), city_.Submit(Stand{17, 90})});
  EXPECT_EQ(CountOpen(), 0u) << "what is forbidden is no hypothesis";
  EXPECT_EQ(city_.Counts().reconstructions.size(), 2u);
  EXPECT_TRUE(IsSound(city_.Ask().snapshot()));
}

TEST_F(DoubtfulSeam, GoesWithItsPhotos) {
  ASSERT_EQ(CountOpen(), 1u);
  RemoveRequest request;
  request.actor = "bea";
  for (const AddOutcome& outcome : outcomes_) {
    const auto image = city_.engine().Ask().Image(outcome.name);
    ASSERT_OK(image);
    if (image->reconstruction == ReconstructionId(2)) request.photos.push_back(outcome.name);
  }
  ASSERT_GE(request.photos.size(), 3u);
  std::string last;
  std::swap(last, request.photos.back());
  request.photos.pop_back();
  ASSERT_OK(city_.engine().Remove(request));
  EXPECT_TRUE(IsSound(city_.Ask().snapshot()));
  request.photos = {last};
  ASSERT_OK(city_.engine().Remove(request));
  ASSERT_OK(city_.engine().Settle());
  EXPECT_EQ(CountOpen(), 0u);
  EXPECT_TRUE(IsSound(city_.Ask().snapshot()));
}

}  // namespace
}  // namespace veduta
