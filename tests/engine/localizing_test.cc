// SPDX-License-Identifier: Apache-2.0
// Goal: photos are localised through the door without being added: near where they were taken, each
//   answered in its turn, nothing changed, beside a writer, and the same on any number of threads.
//   What is told of an answer may use the engine.
// Method: a walk along a rendered street; some of its photos are added, the others asked about.
#include <gtest/gtest.h>

#include <stop_token>

#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

LocalizeRequest Ask(const Stand& stand) {
  const TakenPhoto& photo = TakePhoto(stand);
  return {{photo.name, photo.name, photo.jpeg}, "street"};
}

// Every second photo of the walk, and the others.
struct Halves {
  std::vector<Stand> added, asked;
};

Halves Split(const std::vector<Stand>& walk) {
  Halves halves;
  for (size_t i = 0; i < walk.size(); ++i)
    (i % 2 == 0 ? halves.added : halves.asked).push_back(walk[i]);
  halves.asked.pop_back();  // at the end of the walk, beyond what is added
  return halves;
}

std::vector<LocalizedPhoto> Localize(const Questions& ask,
                                     const std::vector<LocalizeRequest>& photos) {
  std::vector<LocalizedPhoto> answers;
  EXPECT_OK(ask.Localize(photos, [&](const LocalizedPhoto& photo) { answers.push_back(photo); }));
  return answers;
}

TEST(Localizing, AgreesWithAddingAndChangesNothing) {
  const Halves halves = Split(Walk(5, 0.5, 16));
  City city;
  city.Add(halves.added);
  const std::string digest = city.Digest();
  std::vector<LocalizeRequest> photos;
  for (const Stand& stand : halves.asked) photos.push_back(Ask(stand));
  // Another process would open it like that, while this one may write.
  EngineOptions options;
  options.read_only = true;
  options.thread_count = 1;
  auto reader = Engine::Open(city.path(), options);
  ASSERT_OK(reader);
  const std::vector<LocalizedPhoto> alone = Localize((*reader)->Ask(), photos);
  const std::vector<LocalizedPhoto> beside = Localize(city.engine().Ask(), photos);
  ASSERT_EQ(alone.size(), photos.size());
  ASSERT_EQ(beside.size(), photos.size());
  EXPECT_EQ(city.Digest(), digest);
  const std::vector<AddOutcome> outcomes = city.Add(halves.asked);
  for (size_t i = 0; i < photos.size(); ++i) {
    EXPECT_EQ(alone[i].name, photos[i].photo.name);
    ASSERT_TRUE(alone[i].cam_from_world && beside[i].cam_from_world)
        << alone[i].name << ": " << alone[i].detail;
    EXPECT_EQ(alone[i].cam_from_world->rotation_wxyz, beside[i].cam_from_world->rotation_wxyz);
    EXPECT_EQ(alone[i].cam_from_world->translation, beside[i].cam_from_world->translation);
    EXPECT_FALSE(alone[i].support.empty());
    EXPECT_TRUE(alone[i].uncertainty);
    // The photo takes the same place when it is added; the frame stays.
    const auto added = city.engine().Ask().Image(photos[i].photo.name);
    ASSERT_OK(added);
    ASSERT_TRUE(added->cam_from_world) << outcomes[i].detail;
    EXPECT_EQ(added->reconstruction, alone[i].reconstruction);
    Eigen::Vector3d one(alone[i].cam_from_world->center.data());
    Eigen::Vector3d other(added->cam_from_world->center.data());
    const double walked = (Eigen::Vector3d(alone.front().cam_from_world->center.data()) -
                           Eigen::Vector3d(alone.back().cam_from_world->center.data()))
                              .norm();
    EXPECT_LT((one - other).norm(), 0.01 * walked) << alone[i].name;
  }
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

TEST(Localizing, EachPhotoHasItsAnswerInItsTurn) {
  const std::vector<Stand> walk = Walk(5, 0.5, 6);
  City city(City::Options(4));
  city.Add(walk);
  std::vector<LocalizeRequest> photos = {Ask(walk[2]), Ask(walk[1]), Ask(walk[0])};
  photos[1].photo.bytes = std::vector<uint8_t>{'n', 'o'};
  photos.push_back({{"gone.jpg", "no such file.jpg", {}}, "street"});
  const std::vector<LocalizedPhoto> answers = Localize(city.engine().Ask(), photos);
  ASSERT_EQ(answers.size(), 4u);
  EXPECT_TRUE(answers[0].stored.valid());
  EXPECT_EQ(answers[0].name, photos[0].photo.name);
  EXPECT_EQ(answers[1].verdict, Verdict::kRejected);
  EXPECT_EQ(answers[1].reason, Reason::kUnsupportedFormat);
  EXPECT_EQ(answers[2].name, photos[2].photo.name);
  EXPECT_EQ(answers[3].failure.code(), StatusCode::kNotFound) << answers[3].failure.message();
  EXPECT_EQ(answers[3].name, "gone.jpg");
}

TEST(Localizing, ACallbackMayUseTheEngine) {
  const std::vector<Stand> walk = Walk(5, 0.5, 4);
  City city(City::Options(4));
  city.Add({walk[0], walk[1]});
  std::vector<std::string> reported;
  const auto report = [&](const LocalizedPhoto& photo) {
    reported.push_back(photo.name);
    EXPECT_OK(city.engine().AddCamera("of " + photo.name, StreetCameraModel(), "a test"));
    EXPECT_OK(city.engine().Settle());
  };
  std::vector<LocalizeRequest> photos;
  for (const Stand& stand : walk) photos.push_back(Ask(stand));
  ASSERT_OK(city.engine().Ask().Localize(photos, report));
  ASSERT_EQ(reported.size(), photos.size());
  for (size_t i = 0; i < photos.size(); ++i) EXPECT_EQ(reported[i], photos[i].photo.name);
  EXPECT_EQ(city.engine().Ask().Cameras()->size(), 1 + photos.size());
}

TEST(Localizing, APhotoWithoutPathAndBytesIsNamed) {
  City city;
  const LocalizeRequest good = Ask({5, 90}), nothing{{"a.jpg", "", {}}, "street"};
  EXPECT_OK(good.Check());
  const auto report = [](const LocalizedPhoto&) { ADD_FAILURE(); };
  const Status refused = city.engine().Ask().Localize({{good, nothing}}, report);
  EXPECT_EQ(refused.code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(refused.message(),
            "LocalizeRequest[1].photo.path is empty, but must name a file where photo.bytes is not "
            "set");
}

TEST(Localizing, WantsAKnownCameraAndStopsWhenAsked) {
  City city;
  uint32_t reported = 0;
  const auto report = [&](const LocalizedPhoto&) { ++reported; };
  const Questions ask = city.engine().Ask();
  LocalizeRequest stranger = Ask({5, 90});
  stranger.camera = "nobody's";
  EXPECT_EQ(ask.Localize({{Ask({5, 90}), stranger}}, report).code(), StatusCode::kNotFound);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(ask.Localize({{Ask({5, 90})}}, report, stop.get_token()).code(),
            StatusCode::kCancelled);
  EXPECT_EQ(reported, 0u);
  EXPECT_OK(ask.Localize({}, report));
}

}  // namespace
}  // namespace veduta
