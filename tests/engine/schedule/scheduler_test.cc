// SPDX-License-Identifier: Apache-2.0
// Goal: photos of one contributor keep their order however fast each is prepared; a preparation
//   that failed is tried again; a step that fails when nobody waits is told to the next Settle; a
//   vocabulary is trained and a large reconstruction adjusted while photos go on, and lists and
//   Settle wait for the end; a stream of photos holds up neither a list nor Settle.
// Method: photos of a rendered street, and files that are no photos and so are prepared at once.
//   The first long step of a scheduler of the test's own is held up until the test lets it go on.
#include "engine/schedule/scheduler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <new>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "tests/engine/street_fixture.h"
#include "tests/storage/fault_file_system.h"

namespace veduta {
namespace {

// A file that is rejected after a look at its first bytes.
PhotoSubmission NoPhoto(City* city, uint32_t number) {
  const std::string text = "no photo " + std::to_string(number);
  return city->Submit("no-photo-" + std::to_string(number), {text.begin(), text.end()});
}

// As Engine::Submit, of a photo that waits in memory alone.
Result<Ticket> Put(Scheduler* scheduler, PhotoSource source, const CameraRecord& camera,
                   const std::string& contributor) {
  static std::atomic<uint64_t> last_number = 0;
  WaitingPhoto photo;
  photo.photo = std::move(source);
  photo.camera = camera;
  photo.contributor = contributor;
  return scheduler->Submit(++last_number, std::move(photo));
}

// Waits for what another thread does.
void WaitUntil(const std::function<bool()>& holds) {
  while (!holds()) std::this_thread::yield();
}

TEST(Scheduler, APhotoThatIsPreparedFasterDoesNotOvertake) {
  City city;
  const std::vector<Stand> stands = Walk(6, 0.9, 3);
  for (size_t i = 0; i < stands.size(); ++i) {
    const PhotoSubmission slow = city.Submit(stands[i]);
    const Ticket first = *city.engine().Submit(slow);
    const Ticket second = *city.engine().Submit(NoPhoto(&city, static_cast<uint32_t>(i)));
    ASSERT_OK(first.Wait());
    ASSERT_OK(second.Wait());
    EXPECT_LT(first.Wait()->id.value, second.Wait()->id.value);
  }
}

TEST(Scheduler, APreparationThatFailedIsTriedAgain) {
  const auto disk = std::make_shared<FaultFileSystem>();
  CityOptions options = City::Options(2);
  options.database.sync_wal = true;
  options.database.file_system = disk;
  City city(options);
  const PhotoSubmission photo = city.Submit(Walk(6, 0.9, 1)[0]);
  EngineParts& parts = city.parts();
  Ticket blocked, failing;
  std::atomic<bool> has_submitted = false, has_turn = false;
  // The scheduler takes both into its window at once, and then waits for the turn with the first.
  const auto submit_both = [&](const Result<AddOutcome>&) {
    blocked = *city.engine().Submit(NoPhoto(&city, 2));
    failing = *city.engine().Submit(photo);
    has_submitted = true;
    WaitUntil([&] { return has_turn.load(); });
  };
  ASSERT_OK(city.engine().Submit(NoPhoto(&city, 1), submit_both));
  WaitUntil([&] { return has_submitted.load(); });
  {
    Writer::Turn turn = parts.writer->Take();
    disk->FailWrites(1, Fault::kIoError, 1);
    has_turn = true;
    WaitUntil([&] { return disk->fault_count() > 0; });
    disk->Heal();
    ASSERT_OK(turn.database().Reopen());
    parts.RenewCaches();
  }
  EXPECT_OK(blocked.Wait());
  EXPECT_OK(failing.Wait());
  EXPECT_EQ(city.Counts().images, 3u);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

void PutPending(City* city, std::vector<ImageId> images) {
  const auto transaction = city->parts().database->BeginTransaction();
  DatabaseState state = *transaction->base()->GetState();
  state.pending_propagation = std::move(images);
  transaction->PutState(state);
  ASSERT_OK(transaction->Commit());
}

TEST(Scheduler, AStepThatFailedUnseenIsToldLaterAndTriedAgain) {
  City city;
  PutPending(&city, {ImageId(99)});  // to be tried again, and not there
  // At the latest after eight photos in a row a step is done, and there are no others.
  std::vector<Ticket> tickets;
  for (uint32_t i = 0; i < 10; ++i) tickets.push_back(*city.engine().Submit(NoPhoto(&city, i)));
  for (const Ticket& ticket : tickets) ASSERT_OK(ticket.Wait());
  std::vector<FollowUp> told;
  const auto tell = [&](const FollowUp& step) { told.push_back(step); };
  EXPECT_EQ(city.engine().Settle({}, tell).code(), StatusCode::kNotFound);
  ASSERT_EQ(told.size(), 2u) << "the one that nobody saw, and one more try";
  for (const FollowUp& step : told) EXPECT_EQ(step.image, ImageId(99));
  PutPending(&city, {});
  EXPECT_OK(city.engine().Settle({}, tell));
  EXPECT_EQ(told.size(), 2u);
}

CityOptions TrainingEarly() {
  CityOptions options = City::Options(2);
  options.ingest.retrieval.compare_all_max = 3;
  options.ingest.retrieval.training_count_max = 2000;
  return options;
}

// A scheduler whose first long step waits until it is let go.
class HeldLongStep {
 public:
  explicit HeldLongStep(EngineParts* parts)
      : scheduler_(parts->writer.get(), parts->preparer.get(), &parts->ingest, parts->pool.get(),
                   CameraFinder(), [this, parts](const DueStep& step) {
                     if (!has_begun.exchange(true)) let_go.get_future().wait();
                     return parts->DoLongStep(step);
                   }) {}
  Scheduler* operator->() { return &scheduler_; }
  Scheduler& operator*() { return scheduler_; }

  std::atomic<bool> has_begun = false;
  std::promise<void> let_go;

 private:
  Scheduler scheduler_;  // last: its threads use the above
};

TEST(Scheduler, PhotosGoOnWhileAVocabularyIsTrained) {
  City city(TrainingEarly());
  HeldLongStep scheduler(&city.parts());
  const CameraRecord camera = *city.parts().FindCamera("street");
  const auto submit = [&](const Stand& stand) {
    return Put(&*scheduler, city.Submit(stand).photo, camera, "anna")->Wait();
  };
  const std::vector<Stand> stands = Walk(6, 0.9, 5);
  for (size_t i = 0; i < 3; ++i) ASSERT_OK(submit(stands[i]));
  WaitUntil([&] { return scheduler.has_begun.load(); });
  ASSERT_OK(submit(stands[3]));
  ASSERT_OK(submit(stands[4]));
  EXPECT_EQ(city.Counts().vocabulary_generation, 0u);

  std::atomic<bool> has_settled = false;
  std::vector<FollowUp> followed;
  std::thread settler([&] {
    EXPECT_OK(scheduler->Settle({}, &followed));
    has_settled = true;
  });
  ASSERT_OK(Put(&*scheduler, NoPhoto(&city, 1).photo, camera, "bela")->Wait());
  EXPECT_FALSE(has_settled);
  scheduler.let_go.set_value();
  settler.join();
  // An adjustment that was due when Settle came is done after the training.
  EXPECT_EQ(std::ranges::count(followed, FollowUpKind::kVocabulary, &FollowUp::kind), 1);
  EXPECT_EQ(city.Counts().vocabulary_generation, 1u);
  EXPECT_TRUE(IsSound(city.Ask().snapshot())) << "also the photos that came meanwhile have words";
}

TEST(Scheduler, AListWaitsForATrainingThatAnEarlierPhotoBegan) {
  City city(TrainingEarly());
  HeldLongStep scheduler(&city.parts());
  const CameraRecord camera = *city.parts().FindCamera("street");
  const std::vector<Stand> stands = Walk(6, 0.9, 4);
  for (size_t i = 0; i < 3; ++i)
    ASSERT_OK(Put(&*scheduler, city.Submit(stands[i]).photo, camera, "anna")->Wait());
  WaitUntil([&] { return scheduler.has_begun.load(); });
  const std::shared_ptr<Lane> lane = scheduler->OpenList({});
  const Ticket of_list =
      scheduler->SubmitToList(lane, city.Submit(stands[3]).photo, camera, "anna");
  // Another contributor's photo overtakes the list's, which waits.
  ASSERT_OK(Put(&*scheduler, NoPhoto(&city, 1).photo, camera, "bela")->Wait());
  EXPECT_FALSE(of_list.IsDone());
  scheduler.let_go.set_value();
  std::vector<FollowUp> steps;
  ASSERT_OK(Scheduler::WaitSettled(of_list, &steps));
  EXPECT_EQ(city.Counts().vocabulary_generation, 1u);
  scheduler->EndList(lane.get());
}

// Above four photos a reconstruction has submaps, and all of it is adjusted with each photo.
CityOptions LargeEarly() {
  CityOptions options = City::Options(2);
  options.ingest.schedule.whole_images_max = 4;
  options.ingest.schedule.submap_images_max = 3;
  options.ingest.schedule.submap_images_min = 2;
  options.ingest.schedule.region_images_max = 6;
  options.ingest.schedule.views_step = 1;
  options.ingest.schedule.growth_share = 0.01;
  options.ingest.schedule.whole_again_share = 0.01;
  return options;
}

// Sends photos one by one until the long step begins, and says how many.
size_t SubmitUntilItBegins(std::span<const Stand> stands, City* city, HeldLongStep* scheduler) {
  const CameraRecord camera = *city->parts().FindCamera("street");
  size_t sent = 0;
  while (sent < stands.size() && !scheduler->has_begun) {
    EXPECT_OK(Put(&**scheduler, city->Submit(stands[sent++]).photo, camera, "anna")->Wait());
    const auto pause = std::chrono::steady_clock::now() + std::chrono::seconds(2);
    WaitUntil([&] { return scheduler->has_begun || std::chrono::steady_clock::now() > pause; });
  }
  return sent;
}

class WithAndWithoutSubmaps : public testing::TestWithParam<bool> {};

TEST_P(WithAndWithoutSubmaps, PhotosGoOnWhileALargeReconstructionIsAdjusted) {
  CityOptions options = LargeEarly();
  if (!GetParam()) options.ingest.schedule.whole_images_max = 100;
  City city(options);
  HeldLongStep scheduler(&city.parts());
  const CameraRecord camera = *city.parts().FindCamera("street");
  const std::vector<Stand> stands = Walk(12, 0.9, 10);
  size_t sent = SubmitUntilItBegins({stands.data(), 8}, &city, &scheduler);
  ASSERT_TRUE(scheduler.has_begun);
  const auto submit = [&] {
    return Put(&*scheduler, city.Submit(stands[sent++]).photo, camera, "anna")->Wait();
  };
  const uint32_t before = city.Counts().placed;
  ASSERT_OK(submit());
  ASSERT_OK(submit());
  EXPECT_GT(city.Counts().placed, before) << "while the whole is being adjusted";
  std::vector<FollowUp> followed;
  std::atomic<bool> has_settled = false;
  std::thread settler([&] {
    EXPECT_OK(scheduler->Settle({}, &followed));
    has_settled = true;
  });
  ASSERT_OK(Put(&*scheduler, NoPhoto(&city, 1).photo, camera, "bela")->Wait());
  EXPECT_FALSE(has_settled);
  scheduler.let_go.set_value();
  settler.join();
  ASSERT_FALSE(followed.empty());
  EXPECT_EQ(followed.front().kind, FollowUpKind::kAdjustment);
  EXPECT_GT(followed.front().ms, followed.front().turn_ms);
  EXPECT_EQ(city.Counts().placed, sent);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

INSTANTIATE_TEST_SUITE_P(Scheduler, WithAndWithoutSubmaps, testing::Bool());

TEST(Scheduler, ClosingWaitsForALargeAdjustmentAndKeepsIt) {
  City city(LargeEarly());
  HeldLongStep scheduler(&city.parts());
  const CameraRecord camera = *city.parts().FindCamera("street");
  SubmitUntilItBegins(Walk(12, 0.9, 8), &city, &scheduler);
  ASSERT_TRUE(scheduler.has_begun);
  std::atomic<bool> is_closed = false;
  std::thread closer([&] {
    scheduler->Close();
    is_closed = true;
  });
  WaitUntil([&] { return !Put(&*scheduler, NoPhoto(&city, 1).photo, camera, "bela").ok(); });
  EXPECT_FALSE(is_closed);
  scheduler.let_go.set_value();
  closer.join();
  std::vector<std::string> actions;
  ASSERT_OK(city.Ask().snapshot().ScanJournal(1, [&](const JournalRecord& entry) {
    actions.push_back(entry.action);
    return true;
  }));
  EXPECT_EQ(actions.back(), "adjust");
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

TEST(Scheduler, AFailedLargeAdjustmentHoldsNothingElseUpAndIsTriedAgainByEachSettle) {
  City city(LargeEarly());
  EngineParts& parts = city.parts();
  std::atomic<int> tried = 0;
  Scheduler scheduler(parts.writer.get(), parts.preparer.get(), &parts.ingest, parts.pool.get(),
                      CameraFinder(), [&](const DueStep& step) -> Result<std::optional<FollowUp>> {
                        EXPECT_EQ(step.kind, FollowUpKind::kAdjustment);
                        ++tried;
                        return Status::NoMemory("no room today");
                      });
  const CameraRecord camera = *parts.FindCamera("street");
  for (const Stand& stand : Walk(12, 0.9, 7))
    ASSERT_OK(Put(&scheduler, city.Submit(stand).photo, camera, "anna")->Wait());
  for (int settled = 0; settled < 3; ++settled) {
    const int before = tried;
    std::vector<FollowUp> followed;
    EXPECT_EQ(scheduler.Settle({}, &followed).message(), "no room today");
    if (settled > 0) {  // at first one may have begun before
      EXPECT_EQ(tried, before + 1);
    }
    EXPECT_TRUE(std::ranges::any_of(followed, [](const FollowUp& step) {
      return step.kind == FollowUpKind::kAdjustment && !step.status.ok();
    }));
  }
  EXPECT_GT(city.Counts().placed, 4u) << "photos come to it all the same";
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

// A list waits for each of its large adjustments, so it does not matter that they have a thread.
TEST(Scheduler, AListGivesTheSameCityAtAnyNumberOfThreads) {
  std::string digest;
  for (const uint32_t threads : {1u, 3u}) {
    CityOptions options = LargeEarly();
    options.thread_count = threads;
    City city(options);
    city.Add(Walk(12, 0.9, 9));
    size_t large = 0;
    ASSERT_OK(city.Ask().snapshot().ScanJournal(1, [&](const JournalRecord& entry) {
      large += entry.action == "adjust" && entry.detail == "9 images";
      return true;
    }));
    EXPECT_GE(large, 1u);
    if (digest.empty()) digest = city.Digest();
    EXPECT_EQ(city.Digest(), digest);
  }
}

// A list of the photos in the order in which contributors had their turns.
TEST(Scheduler, PhotosThatAreSettledEachGiveTheCityOfAListInTheirOrder) {
  CityOptions options = LargeEarly();
  City list(options);
  options.settle_each = true;
  City city(options);
  std::vector<PhotoSubmission> photos;
  for (const Stand& stand : Walk(12, 0.9, 9)) {
    photos.push_back(city.Submit(stand));
    photos.back().contributor = photos.size() % 3 == 0 ? "bela" : "anna";
  }
  std::vector<Ticket> tickets;
  for (const PhotoSubmission& photo : photos) tickets.push_back(*city.engine().Submit(photo));
  std::vector<std::pair<uint32_t, size_t>> order;
  for (size_t i = 0; i < photos.size(); ++i) {
    const Result<AddOutcome> outcome = tickets[i].Wait();
    ASSERT_OK(outcome);
    order.emplace_back(outcome->id.value, i);
  }
  ASSERT_OK(city.engine().Settle());  // of the last photo
  std::ranges::sort(order);
  std::vector<PhotoSubmission> ordered;
  for (const auto& [id, i] : order) ordered.push_back(photos[i]);
  list.Add(ordered);
  EXPECT_EQ(city.Digest(), list.Digest());
}

TEST(Scheduler, AStepThatFailsWhileNoListWaitsIsToldLater) {
  CityOptions options = City::Options(2);
  options.settle_each = true;
  City city(options);
  PutPending(&city, {ImageId(99)});  // to be tried again, and not there
  ASSERT_OK((*city.engine().Submit(NoPhoto(&city, 1))).Wait());
  ASSERT_OK((*city.engine().Submit(NoPhoto(&city, 2))).Wait());  // which waited for the step
  std::vector<FollowUp> told;
  city.engine()
      .Settle({}, [&](const FollowUp& step) { told.push_back(step); })
      .IgnoreBecause("the step fails again");
  EXPECT_EQ(told.size(), 2u);
  for (const FollowUp& step : told) EXPECT_FALSE(step.status.ok());
}

TEST(Scheduler, AFailedTrainingIsToldAndTriedAgainByEachSettle) {
  City city(TrainingEarly());
  EngineParts& parts = city.parts();
  std::atomic<int> trainings = 0;
  Scheduler scheduler(parts.writer.get(), parts.preparer.get(), &parts.ingest, parts.pool.get(),
                      CameraFinder(), [&](const DueStep&) -> Result<std::optional<FollowUp>> {
                        ++trainings;
                        return Status::IoError("no luck today");
                      });
  const CameraRecord camera = *parts.FindCamera("street");
  for (const Stand& stand : Walk(6, 0.9, 4))
    ASSERT_OK(Put(&scheduler, city.Submit(stand).photo, camera, "anna")->Wait());
  for (int settled = 0; settled < 3; ++settled) {
    const int before = trainings;
    std::vector<FollowUp> followed;
    EXPECT_EQ(scheduler.Settle({}, &followed).message(), "no luck today");
    if (settled > 0) {  // at first one may have begun before
      EXPECT_EQ(trainings, before + 1);
    }
    ASSERT_FALSE(followed.empty());
    EXPECT_EQ(followed.back().kind, FollowUpKind::kVocabulary);
  }
}

TEST(Scheduler, ATrainingWithoutMemoryIsAFailureThatIsTold) {
  City city(TrainingEarly());
  EngineParts& parts = city.parts();
  Scheduler scheduler(
      parts.writer.get(), parts.preparer.get(), &parts.ingest, parts.pool.get(), CameraFinder(),
      [](const DueStep&) -> Result<std::optional<FollowUp>> { throw std::bad_alloc(); });
  const CameraRecord camera = *parts.FindCamera("street");
  for (const Stand& stand : Walk(6, 0.9, 3))
    ASSERT_OK(Put(&scheduler, city.Submit(stand).photo, camera, "anna")->Wait());
  std::vector<FollowUp> followed;
  const Status settled = scheduler.Settle({}, &followed);
  EXPECT_EQ(settled.code(), StatusCode::kNoMemory);
  EXPECT_NE(settled.message().find("train the vocabulary"), std::string::npos);
}

// Somebody always has a photo in line.
TEST(Scheduler, AStreamOfPhotosHoldsUpNeitherAListNorSettle) {
  City city;
  std::atomic<bool> is_enough = false;
  std::atomic<uint32_t> streamed = 0;
  std::thread stream([&] {
    std::vector<Ticket> tickets;
    for (uint32_t i = 0; !is_enough; ++i) {
      tickets.push_back(*city.engine().Submit(NoPhoto(&city, i)));
      if (i >= 20) {
        EXPECT_OK(tickets[i - 20].Wait());
      }
      ++streamed;
    }
  });
  WaitUntil([&] { return streamed > 20; });
  city.Add(Walk(6, 0.9, 3));
  EXPECT_OK(city.engine().Settle());
  const uint32_t meanwhile = streamed;
  is_enough = true;
  stream.join();
  EXPECT_GT(meanwhile, 21u);
  EXPECT_EQ(city.Counts().placed, 3u);
}

}  // namespace
}  // namespace veduta
