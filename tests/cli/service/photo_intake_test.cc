// SPDX-License-Identifier: Apache-2.0
// Goal: photos that come in are answered by what became of them; a full line sends away; closing
//   answers who waits, and what waited is placed by the next daemon.
// Method: files that are no photos, which are judged at once, while another writer's turn holds the
//   first of them up as long as the test wants.
#include "cli/service/photo_intake.h"

#include <gtest/gtest.h>

#include <atomic>
#include <condition_variable>
#include <thread>
#include <vector>

#include "tests/engine/street_fixture.h"
#include "tests/option_bounds.h"

namespace veduta {
namespace {

// Answers as they come, from whatever thread.
class Answers {
 public:
  Answered Take() {
    return [this](HttpAnswer answer) {
      const std::lock_guard lock(mutex_);
      answers_.push_back(std::move(answer));
      changed_.notify_all();
    };
  }
  std::vector<HttpAnswer> Wait(size_t count) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return answers_.size() >= count; });
    return answers_;
  }
  size_t CountOf(uint32_t code) {
    const std::lock_guard lock(mutex_);
    return std::ranges::count(answers_, code, &HttpAnswer::code);
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<HttpAnswer> answers_;
};

void Ignore(uint64_t, const std::string&, const Result<AddOutcome>&) {}

HttpRequest Photo(const std::string& name, std::vector<uint8_t> bytes) {
  HttpRequest request;
  request.method = "POST";
  request.content_type = "image/jpeg";
  request.query = {{"name", name}, {"camera", "street"}};
  request.body = std::move(bytes);
  return request;
}

HttpRequest NoPhoto(uint32_t number) {
  const std::string text = "no photo " + std::to_string(number);
  HttpRequest photo = Photo("no-photo-" + std::to_string(number), {text.begin(), text.end()});
  photo.query["contributor"] = "number " + std::to_string(number);
  return photo;
}

TEST(PhotoIntake, AnswersSayWhatBecameOfPhotos) {
  PhotoIntake intake({.photos_max = 8}, Ignore);
  City city;
  Answers answers;
  const std::vector<uint8_t> jpeg = TakePhoto(Walk(6, 0.9, 1)[0]).jpeg;
  intake.Take(&city.engine(), Photo("a.jpg", jpeg), answers.Take());
  HttpAnswer stored = answers.Wait(1)[0];
  EXPECT_EQ(stored.code, 201u) << stored.body;
  EXPECT_EQ(stored.headers.at(0).second, "/v1/photos/%231");
  intake.Take(&city.engine(), Photo("b.jpg", jpeg), answers.Take());
  EXPECT_EQ(answers.Wait(2)[1].code, 409u);
  intake.Take(&city.engine(), NoPhoto(1), answers.Take());
  EXPECT_EQ(answers.Wait(3)[2].code, 422u);
  HttpRequest unknown_camera = NoPhoto(2);
  unknown_camera.query["camera"] = "none";
  intake.Take(&city.engine(), unknown_camera, answers.Take());
  EXPECT_EQ(answers.Wait(4)[3].code, 404u);
  HttpRequest nameless = NoPhoto(3);
  nameless.query.erase("name");
  intake.Take(&city.engine(), nameless, answers.Take());
  EXPECT_EQ(answers.Wait(5)[4].code, 400u);
  const PhotoIntake::Counts counts = intake.counts();
  EXPECT_EQ(counts.waiting, 0u);
  EXPECT_EQ(counts.ended, (std::map<std::string, uint64_t>{
                              {"postponed", 1}, {"duplicate", 1}, {"rejected", 1}, {"failed", 1}}));
}

// As it is in a form and by the tus protocol.
TEST(PhotoIntake, StrangersGivePlainNames) {
  PhotoIntake intake({.photos_max = 8}, Ignore);
  City city;
  Answers answers;
  HttpRequest photo = NoPhoto(1);
  size_t count = 0;
  for (const std::string& name :
       {std::string("an\nna"), std::string("\xff"), std::string(1025, 'a')}) {
    photo.query["contributor"] = name;
    intake.Take(&city.engine(), photo, answers.Take());
    EXPECT_EQ(answers.Wait(++count).back().code, 400u) << name;
  }
  photo.is_of_owner = true;
  photo.query["contributor"] = "\xff";
  intake.Take(&city.engine(), photo, answers.Take());
  EXPECT_EQ(answers.Wait(++count).back().code, 422u) << "it is judged";
}

TEST(PhotoIntake, AFullLineSendsAway) {
  PhotoIntake intake({.photos_max = 2}, Ignore);
  City city;
  Answers answers;
  {
    Writer::Turn turn = city.parts().writer->Take();
    for (uint32_t i = 0; i < 5; ++i) intake.Take(&city.engine(), NoPhoto(i), answers.Take());
    for (const HttpAnswer& answer : answers.Wait(3)) {
      EXPECT_EQ(answer.code, 429u);
      EXPECT_EQ(answer.headers.at(0), std::make_pair(std::string("Retry-After"), std::string("1")));
    }
    EXPECT_EQ(intake.counts().waiting, 2u);
  }
  answers.Wait(5);
  EXPECT_EQ(answers.CountOf(422), 2u);
}

TEST(PhotoIntake, TheSecondHalfOfTheLineIsForOthers) {
  PhotoIntake intake({.photos_max = 4}, Ignore);
  City city;
  Answers answers;
  const auto take = [&](uint32_t number, const char* contributor) {
    HttpRequest photo = NoPhoto(number);
    photo.query["contributor"] = contributor;
    intake.Take(&city.engine(), photo, answers.Take());
  };
  {
    Writer::Turn turn = city.parts().writer->Take();
    for (uint32_t i = 0; i < 3; ++i) take(i, "anna");
    EXPECT_EQ(answers.Wait(1).at(0).code, 429u);
    take(3, "bela");
    take(4, "cara");
    take(5, "bela");
    take(6, "dora");
    EXPECT_EQ(answers.Wait(3).size(), 3u) << "the second one of bela, and dora: the line is full";
    EXPECT_EQ(answers.CountOf(429), 3u);
  }
  answers.Wait(7);
  EXPECT_EQ(answers.CountOf(422), 4u);
  take(7, "anna");
  EXPECT_EQ(answers.Wait(8).back().code, 422u) << "places come back";
}

TEST(PhotoIntake, BytesAreBoundedAsPhotosAre) {
  PhotoIntake intake({.bytes_max = 25}, Ignore);
  City city;
  Answers answers;
  {
    Writer::Turn turn = city.parts().writer->Take();
    for (uint32_t i = 0; i < 3; ++i) intake.Take(&city.engine(), NoPhoto(i), answers.Take());
    EXPECT_EQ(answers.Wait(1).at(0).code, 429u) << "each has 10 bytes";
    EXPECT_EQ(intake.counts().waiting_bytes, 20u);
  }
  answers.Wait(3);
  EXPECT_EQ(answers.CountOf(422), 2u);
  EXPECT_EQ(intake.counts().waiting_bytes, 0u);
}

TEST(PhotoIntake, WhoDoesNotWantToWaitAsksLater) {
  PhotoIntake intake({}, Ignore);
  City city;
  Answers answers;
  HttpRequest photo = NoPhoto(1);
  photo.prefers_async = true;
  {
    Writer::Turn turn = city.parts().writer->Take();
    intake.Take(&city.engine(), photo, answers.Take());
    const HttpAnswer accepted = answers.Wait(1).at(0);
    EXPECT_EQ(accepted.code, 202u);
    EXPECT_EQ(accepted.headers.at(0),
              std::make_pair(std::string("Location"), std::string("/v1/uploads/1")));
    EXPECT_EQ(Json::parse(intake.Find(1).body)["state"], "waiting");
  }
  while (Json::parse(intake.Find(1).body)["state"] == "waiting") std::this_thread::yield();
  const Json done = Json::parse(intake.Find(1).body);
  EXPECT_EQ(done["state"], "done");
  EXPECT_EQ(done["outcome"]["verdict"], "rejected");
  EXPECT_EQ(intake.Find(2).code, 404u);
  EXPECT_EQ(answers.Wait(1).size(), 1u);
}

TEST(PhotoIntake, WhoHasLeftIsNotKept) {
  PhotoIntake intake({}, Ignore);
  City city;
  Answers answers;
  std::atomic<int> heard = 0;
  const auto kept = std::make_shared<int>();  // by each that is heard later
  const auto listen = [&heard, kept](const UploadNews&) { ++heard; };
  const auto staying = std::make_shared<int>();
  {
    Writer::Turn turn = city.parts().writer->Take();
    HttpRequest photo = NoPhoto(1);
    photo.prefers_async = true;
    intake.Take(&city.engine(), photo, answers.Take());
    answers.Wait(1);
    EXPECT_FALSE(intake.Await(1, listen, std::weak_ptr<const void>(staying)).has_value());
    for (int i = 0; i < 1000; ++i) {
      const auto leaving = std::make_shared<int>();
      EXPECT_FALSE(intake.Await(1, listen, std::weak_ptr<const void>(leaving)).has_value());
    }
    EXPECT_LT(kept.use_count(), 40);
  }
  while (Json::parse(intake.Find(1).body)["state"] == "waiting") std::this_thread::yield();
  while (heard == 0) std::this_thread::yield();
}

TEST(PhotoIntake, ClosingAnswersWhoWaits) {
  PhotoIntake intake({.photos_max = 8}, Ignore);
  City city;
  Answers answers;
  {
    Writer::Turn turn = city.parts().writer->Take();
    for (uint32_t i = 0; i < 4; ++i) intake.Take(&city.engine(), NoPhoto(i), answers.Take());
    EXPECT_FALSE(intake.is_closing());
    intake.Close();
    EXPECT_TRUE(intake.is_closing());
    EXPECT_EQ(answers.CountOf(202), 4u) << "at once, though nothing can be applied";
    intake.Take(&city.engine(), NoPhoto(9), answers.Take());
    EXPECT_EQ(answers.CountOf(503), 1u) << "it is not stored";
  }
}

TEST(PhotoIntake, AnotherDaemonGoesOnWithWhatWaits) {
  City city;
  {
    PhotoIntake intake({}, Ignore);
    Answers answers;
    std::jthread closing;
    Writer::Turn turn = city.parts().writer->Take();
    for (uint32_t i = 0; i < 4; ++i) intake.Take(&city.engine(), NoPhoto(i), answers.Take());
    intake.Close();
    EXPECT_EQ(answers.CountOf(202), 4u);
    closing = std::jthread([&parts = city.parts()] { parts.scheduler->Close(); });
    EXPECT_EQ(city.engine().Settle().code(), StatusCode::kCancelled) << "once it is being closed";
    const Writer::Turn given_back = std::move(turn);
  }
  city.Close();
  std::atomic<size_t> ended = 0;
  const auto engine = Engine::Open(city.path());
  ASSERT_OK(engine);
  const auto waiting = (*engine)->Ask().Uploads();
  ASSERT_OK(waiting);
  EXPECT_GE(waiting->size(), 3u) << "one may have had its turn";
  PhotoIntake intake({}, [&](uint64_t, const std::string&, const Result<AddOutcome>& outcome) {
    EXPECT_OK(outcome);
    ++ended;
  });
  ASSERT_OK(intake.Resume(engine->get()));
  ASSERT_OK(intake.Resume(engine->get())) << "what is in line stays there";
  while (ended < waiting->size()) std::this_thread::yield();
  for (const UploadAnswer& upload : *waiting)
    EXPECT_EQ(Json::parse(intake.Find(upload.number).body)["state"], "done");
  EXPECT_TRUE((*engine)->Ask().Uploads()->empty());
}

HttpRequest WithoutCamera(const Stand& stand) {
  const TakenPhoto& photo = TakePhoto(stand);
  HttpRequest request = Photo(photo.name, photo.jpeg);
  request.query.erase("camera");
  request.query["contributor"] = "anna";
  return request;
}

TEST(PhotoIntake, WhoseCameraCannotBeToldIsTriedAgainAsTheCityGrows) {
  PhotoIntake intake({}, Ignore);
  City city;
  Answers answers;
  const std::vector<Stand> walk = Walk(5, 0.5, 12);
  const auto state = [&] { return Json::parse(intake.Find(1).body); };
  const auto settle = [&] {  // until nothing waits that may have its turn
    ASSERT_OK(intake.Resume(&city.engine()));
    while (state()["state"] == "waiting" && !state()["awaits_camera"].get<bool>())
      std::this_thread::yield();
  };
  intake.Take(&city.engine(), WithoutCamera(walk[5]), answers.Take());
  const HttpAnswer put_off = answers.Wait(1)[0];
  EXPECT_EQ(put_off.code, 202u) << put_off.body;
  EXPECT_EQ(Json::parse(put_off.body)["awaits_camera"], true);
  EXPECT_NE(put_off.body.find("cannot be estimated yet"), std::string::npos) << put_off.body;
  EXPECT_EQ(intake.counts().awaiting_camera, 1u);
  EXPECT_EQ(intake.counts().waiting, 1u);
  EXPECT_EQ(intake.AwaitCameraless(1, std::chrono::seconds(0), {}), 1u);
  for (size_t i = 0; i < walk.size(); ++i) {
    if (i == 5) continue;
    HttpRequest photo = WithoutCamera(walk[i]);
    photo.query["camera"] = "street";
    intake.Take(&city.engine(), std::move(photo), answers.Take());
    answers.Wait(i < 5 ? i + 2 : i + 1);
    settle();
  }
  EXPECT_EQ(state()["state"], "done");
  EXPECT_EQ(state()["outcome"]["verdict"], "placed") << intake.Find(1).body;
  EXPECT_EQ(intake.counts().awaiting_camera, 0u);
  EXPECT_EQ(intake.counts().waiting, 0u);
}

TEST(PhotoIntake, WhatIsRemovedWhileItWaitsForItsCameraGivesItsPlace) {
  PhotoIntake intake({}, Ignore);
  City city;
  Answers answers;
  intake.Take(&city.engine(), WithoutCamera(Stand{45, 270}), answers.Take());
  EXPECT_EQ(answers.Wait(1)[0].code, 202u);
  RemoveRequest request;
  request.contributor = "anna";
  ASSERT_OK(city.engine().Remove(request));
  ASSERT_OK(intake.Resume(&city.engine()));
  EXPECT_EQ(Json::parse(intake.Find(1).body)["state"], "failed");
  EXPECT_EQ(intake.counts().waiting, 0u);
  EXPECT_EQ(intake.counts().awaiting_camera, 0u);
}

TEST(IntakeLimits, HaveBounds) {
  ExpectBounds(&IntakeLimits::photos_max, "photos_max", {0u, 1'000'001u}, {1u, 1'000'000u});
  ExpectBounds(&IntakeLimits::bytes_max, "bytes_max", {uint64_t{0}}, {uint64_t{1}});
}

}  // namespace
}  // namespace veduta
