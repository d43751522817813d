// SPDX-License-Identifier: Apache-2.0
// Goal: many clients submit at once: Submit returns a ticket at once, one client's many photos do
//   not hold up another's one, a cancelled photo leaves nothing, callbacks may ask and submit, the
//   journal has the order of application, a closed engine answers every ticket, and a list of
//   photos gives the same digest while others submit nothing and holds up nobody else's photo.
// Method: photos of one rendered street, submitted from several threads to an engine of two
//   threads; the outcome is compared with the journal, with verify, and with lists added alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>
#include <vector>

#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

PhotoSubmission From(City* city, const Stand& stand, const std::string& contributor) {
  PhotoSubmission photo = city->Submit(stand);
  photo.contributor = contributor;
  return photo;
}

// Ids of images in the order in which the journal says that they were added.
std::vector<uint32_t> AddedOrder(City* city) {
  std::vector<uint32_t> order;
  const auto journal = city->engine().Ask().Journal(1, 1000);
  EXPECT_OK(journal);
  for (const JournalAnswer& entry : *journal) {
    if (entry.action == "add") order.push_back(entry.image.value);
  }
  return order;
}

size_t CountPhotos(const City& city) {
  size_t count = 0;
  EXPECT_OK(city.Ask().snapshot().ScanPhotoKeys([&](const ContentHash&) { return ++count, true; }));
  return count;
}

TEST(Submission, ManyClientsAtOnce) {
  City city;
  const std::vector<Stand> stands = Walk(6, 0.9, 8);
  for (const Stand& stand : stands) TakePhoto(stand);
  std::vector<Ticket> tickets(stands.size());
  std::vector<std::thread> clients;
  for (size_t i = 0; i < stands.size(); ++i) {
    clients.emplace_back([&, i] {
      auto ticket = city.engine().Submit(From(&city, stands[i], "client " + std::to_string(i % 3)));
      ASSERT_OK(ticket);
      tickets[i] = *ticket;
    });
  }
  for (std::thread& client : clients) client.join();
  for (const Ticket& ticket : tickets) {
    const Result<AddOutcome> outcome = ticket.Wait();
    ASSERT_OK(outcome);
    EXPECT_TRUE(outcome->id.valid());
  }
  ASSERT_OK(city.engine().Settle());
  EXPECT_EQ(city.Counts().images, stands.size());
  EXPECT_EQ(city.Counts().placed, stands.size());
  EXPECT_EQ(city.Counts().backlog, 0u);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  std::vector<uint32_t> order = AddedOrder(&city);
  EXPECT_EQ(order.size(), stands.size());
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end())) << "ids are given in order";
}

TEST(Submission, OnePersonsManyPhotosDoNotHoldUpAnothersOne) {
  City city;
  const std::vector<Stand> stands = Walk(6, 0.9, 9);
  for (const Stand& stand : stands) TakePhoto(stand);
  std::vector<Ticket> many;
  for (size_t i = 0; i + 1 < stands.size(); ++i) {
    many.push_back(*city.engine().Submit(From(&city, stands[i], "anna")));
  }
  const Ticket one = *city.engine().Submit(From(&city, stands.back(), "bela"));
  ASSERT_OK(one.Wait());
  for (const Ticket& ticket : many) ASSERT_OK(ticket.Wait());
  const auto bela = one.Wait();
  // Those of anna that were in preparation already, and one by turns, may come before.
  EXPECT_LE(bela->id.value, 6u);
  EXPECT_LT(bela->id.value, many.back().Wait()->id.value);
}

TEST(Submission, ACancelledPhotoLeavesNothing) {
  City city;
  const std::vector<Stand> stands = Walk(6, 0.9, 6);
  for (const Stand& stand : stands) TakePhoto(stand);
  std::vector<Ticket> tickets;
  for (const Stand& stand : stands) {
    tickets.push_back(*city.engine().Submit(From(&city, stand, "anna")));
  }
  const bool cancelled = tickets.back().Cancel();
  for (size_t i = 0; i + 1 < tickets.size(); ++i) ASSERT_OK(tickets[i].Wait());
  const Result<AddOutcome> last = tickets.back().Wait();
  EXPECT_EQ(last.ok(), !cancelled);
  EXPECT_TRUE(cancelled) << "the sixth photo of one lane was applied before it was cancelled";
  ASSERT_OK(city.engine().Settle());
  EXPECT_EQ(city.Counts().images, stands.size() - 1);
  // Who adds a photo after it knows that the cancelled one was dropped before.
  ASSERT_OK(city.engine().Submit(From(&city, stands.front(), "anna"))->Wait());
  EXPECT_EQ(CountPhotos(city), stands.size() - 1) << "without another opening";
  city.Reopen();
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
  EXPECT_FALSE(city.Ask().FindImage(TakePhoto(stands.back()).name).ok());
}

// The same bytes under a camera of another size, under a bent camera, and under a taken name, at
// once: nothing of them is left, without another opening, and an image has its own features.
TEST(Submission, TheSameBytesTwiceLeaveOnePhotoWithItsOwnFeatures) {
  const std::vector<Stand> stands = Walk(6, 0.9, 4);
  std::vector<std::string> digests;
  for (int round = 0; round < 4; ++round) {
    City city(City::Options(round % 2 == 0 ? 1 : 3));
    CameraModel wrong = StreetCameraModel(), bent = StreetCameraModel();
    wrong.width_px += 2;
    bent.k1 = -0.05;
    ASSERT_OK(city.engine().AddCamera("wrong", wrong, "a test"));
    ASSERT_OK(city.engine().AddCamera("bent", bent, "a test"));
    std::vector<PhotoSubmission> photos;
    for (size_t i = 0; i < stands.size(); ++i) {
      PhotoSubmission copy = city.Submit(stands[i]);
      copy.photo.name = i == 3 ? photos.front().photo.name : "copy of " + copy.photo.name;
      if (i < 3) copy.camera = i == 0 ? "wrong" : "bent";
      if (i != 1) photos.push_back(copy);
      photos.push_back(city.Submit(stands[i]));
      if (i == 1) photos.push_back(copy);
    }
    city.Add(photos);
    EXPECT_EQ(CountPhotos(city), stands.size());
    EXPECT_TRUE(IsSound(city.Ask().snapshot()));
    digests.push_back(city.Digest());
  }
  EXPECT_EQ(std::count(digests.begin(), digests.end(), digests.front()), 4);
}

TEST(Submission, CallbacksMayAskAndSubmit) {
  City city;
  const std::vector<Stand> stands = Walk(6, 0.9, 2);
  std::atomic<int> called = 0;
  Ticket second;
  std::atomic<bool> submitted = false;
  const auto first =
      city.engine().Submit(From(&city, stands[0], "anna"), [&](const Result<AddOutcome>& outcome) {
        ++called;
        ASSERT_OK(outcome);
        EXPECT_OK(city.engine().Ask().Image(outcome->name));
        second = *city.engine().Submit(From(&city, stands[1], "anna"),
                                       [&](const Result<AddOutcome>&) { ++called; });
        submitted = true;
      });
  ASSERT_OK(first);
  ASSERT_OK(first->Wait());
  while (!submitted) std::this_thread::yield();
  ASSERT_OK(second.Wait());
  ASSERT_OK(city.engine().Settle());
  EXPECT_EQ(called, 2);
}

TEST(Submission, AClosedEngineAnswersEveryTicket) {
  City city;
  const std::vector<Stand> stands = Walk(6, 0.9, 6);
  for (const Stand& stand : stands) TakePhoto(stand);
  std::vector<Ticket> tickets;
  for (const Stand& stand : stands) {
    tickets.push_back(*city.engine().Submit(From(&city, stand, "anna")));
  }
  city.Close();
  size_t stored = 0;
  for (const Ticket& ticket : tickets) {
    const Result<AddOutcome> outcome = ticket.Wait();
    if (!outcome.ok()) {
      EXPECT_EQ(outcome.status().code(), StatusCode::kCancelled);
    }
    stored += outcome.ok();
  }
  city.Open();
  EXPECT_EQ(city.Counts().images, stored);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

TEST(Submission, AnUnknownCameraIsSaidAtOnce) {
  City city;
  PhotoSubmission photo = city.Submit({6, 90});
  photo.camera = "none such";
  const auto ticket = city.engine().Submit(photo);
  EXPECT_EQ(ticket.status().code(), StatusCode::kNotFound);
  EXPECT_NE(ticket.status().message().find("street"), std::string::npos)
      << "the message lists the cameras there are";
  const Status added = city.engine().AddPhotos({&photo, 1}, [](const AddOutcome&) {});
  EXPECT_EQ(added.code(), StatusCode::kNotFound);
}

// The same photos one by one, each settled before the next, are what a list is.
TEST(Submission, AListIsItsPhotosOneByOneEachSettled) {
  City list, single;
  const std::vector<Stand> stands = Walk(6, 0.9, 5);
  list.Add(stands);
  for (const Stand& stand : stands) {
    ASSERT_OK(single.engine().Submit(single.Submit(stand))->Wait());
    ASSERT_OK(single.engine().Settle());
  }
  EXPECT_EQ(list.Digest(), single.Digest());
}

// Settling a city that is settled already returns at once.
TEST(Submission, SettlesTwice) {
  City city;
  city.Add(Walk(6, 0.9, 2));
  ASSERT_OK(city.engine().Settle());
  ASSERT_OK(city.engine().Settle());
  ASSERT_OK(city.engine().AddPhotos({}, {}));
}

// Whoever is told of a list's photo may wait for another's: the list's photos do not fill the line.
TEST(Submission, AListDoesNotHoldUpASinglePhoto) {
  for (const uint32_t thread_count : {1u, 2u}) {
    City city(City::Options(thread_count));
    const std::vector<Stand> stands = Walk(6, 0.9, 8);
    std::vector<PhotoSubmission> list;
    for (size_t i = 0; i + 1 < stands.size(); ++i) list.push_back(city.Submit(stands[i]));
    bool is_first = true;
    ASSERT_OK(city.engine().AddPhotos(list, [&](const AddOutcome&) {
      if (!is_first) return;
      is_first = false;
      EXPECT_OK(city.engine().Submit(From(&city, stands.back(), "bela"))->Wait());
    }));
    EXPECT_EQ(city.Counts().images, stands.size());
  }
}

// A caller who breaks off leaves a list that ends, and nobody waits for it.
TEST(Submission, AListEndsWhereItsReportThrows) {
  City city;
  const std::vector<Stand> stands = Walk(6, 0.9, 8);
  std::vector<PhotoSubmission> list;
  for (size_t i = 0; i + 1 < stands.size(); ++i) list.push_back(city.Submit(stands[i]));
  const auto thrower = [](const AddOutcome&) { throw std::runtime_error("enough"); };
  EXPECT_THROW((void)city.engine().AddPhotos(list, thrower), std::runtime_error);
  EXPECT_OK(city.engine().Submit(From(&city, stands.back(), "bela"))->Wait());
  EXPECT_EQ(city.Counts().images, 2u);
}

// One callback for each photo, whether it was cancelled, applied, or overtaken by the closing; and
// what a callback submits while the engine is being closed is refused.
TEST(Submission, EachPhotoIsAnsweredOnceWhenTheEngineCloses) {
  const std::vector<Stand> stands = Walk(6, 0.9, 6);
  for (const Stand& stand : stands) TakePhoto(stand);
  for (const bool submits_again : {false, true}) {
    City city;
    Engine& engine = city.engine();
    std::vector<std::atomic<int>> calls(stands.size());
    std::vector<Ticket> tickets, again;
    for (size_t i = 0; i < stands.size(); ++i) {
      const auto answered = [&, i](const Result<AddOutcome>& outcome) {
        ++calls[i];
        if (outcome.ok() || !submits_again) return;
        Result<Ticket> ticket = engine.Submit(From(&city, stands[i], "anna"));
        if (ticket.ok()) again.push_back(*ticket);
      };
      tickets.push_back(*city.engine().Submit(From(&city, stands[i], "anna"), answered));
    }
    if (!submits_again) {
      for (Ticket& ticket : tickets) ticket.Cancel();
    }
    city.Close();
    for (const std::atomic<int>& count : calls) EXPECT_EQ(count, 1);
    for (const Ticket& ticket : again) EXPECT_TRUE(ticket.IsDone());
  }
}

// Questions may be asked, and AddPhotos comes to its end, when the engine is closed meanwhile.
TEST(Submission, QuestionsAndWaitersOutliveTheEngine) {
  City city;
  const std::vector<Stand> stands = Walk(6, 0.9, 6);
  std::vector<PhotoSubmission> list;
  for (const Stand& stand : stands) list.push_back(city.Submit(stand));
  Questions questions = city.engine().Ask();
  std::atomic<size_t> told = 0;
  std::atomic<bool> closing = false;
  Status added;
  std::thread adds([&, &engine = city.engine()] {
    added = engine.AddPhotos(list, [&](const auto&) {
      ++told;
      while (!closing) std::this_thread::yield();
    });
  });
  while (told == 0) std::this_thread::yield();
  closing = true;
  city.Close();
  adds.join();
  EXPECT_EQ(added.code(), StatusCode::kCancelled);
  const auto status = questions.Status();
  ASSERT_OK(status);
  EXPECT_EQ(status->images, 0u);
  EXPECT_OK(questions.Rank(list.front().photo, "street", 5));
}

TEST(EngineOptions, OpenNamesTheFirstViolatedBound) {
  TemporaryFolder folder;
  EngineOptions options;
  options.create = true;
  options.thread_count = 5000;
  const auto opened = Engine::Open(folder / "db", options);
  EXPECT_EQ(opened.status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(opened.status().message(), "options.thread_count is 5000, but must be from 0 to 1024");
  EngineTuning tuning;
  tuning.ingest.retrieval.retrain_factor = 1;
  options.thread_count = 1;
  const auto tuned = EngineParts::Open(folder / "db", options, tuning);
  EXPECT_EQ(tuned.status().message(),
            "options.ingest.retrieval.retrain_factor is 1, but must be 2 or more");
}

}  // namespace
}  // namespace veduta
