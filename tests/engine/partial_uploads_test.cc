// SPDX-License-Identifier: Apache-2.0
// Goal: a photo that arrives in parts gets in line once, as it came, over closing the engine; other
//   bytes than those that come next are refused; more than may be on its way is refused.
// Method: photos of a street in parts; limits at their borders; a writer's turn that holds the line
//   up as long as the test wants.
#include <gtest/gtest.h>

#include "tests/engine/street_fixture.h"
#include "tests/option_bounds.h"

namespace veduta {
namespace {

constexpr PartialUploadLimits kRoomy;

PartialUploadRequest Request(const std::string& name, uint64_t length, uint32_t token = 0) {
  PartialUploadRequest request;
  request.name = name;
  request.contributor = "anna";
  request.camera = "street";
  request.token = token;
  request.length_bytes = length;
  return request;
}

const std::vector<uint8_t>& Jpeg() {
  return TakePhoto(Walk(6, 0.9, 1)[0]).jpeg;
}

StatusCode CodeOf(const Result<PartialUploadAnswer>& answer) {
  return answer.status().code();
}

TEST(PartialUploadsOfTheDoor, GetInLineOnce) {
  City city;
  const std::vector<uint8_t>& jpeg = Jpeg();
  const auto begun = city.engine().BeginUpload(Request("1.jpg", jpeg.size()), kRoomy);
  ASSERT_OK(begun);
  EXPECT_EQ(begun->id.size(), 32u);
  const size_t half = jpeg.size() / 2;
  const std::span<const uint8_t> bytes(jpeg);
  ASSERT_OK(city.engine().ContinueUpload(begun->id, 0, bytes.first(half)));
  city.Reopen();
  EXPECT_EQ(city.Ask().door().PartialUpload(begun->id)->received_bytes, half);
  EXPECT_EQ(CodeOf(city.engine().ContinueUpload(begun->id, 0, bytes)), StatusCode::kAlreadyExists);
  EXPECT_EQ(CodeOf(city.engine().ContinueUpload(begun->id, half + 1, bytes.first(1))),
            StatusCode::kAlreadyExists);
  EXPECT_EQ(CodeOf(city.engine().ContinueUpload(begun->id, half, bytes)),
            StatusCode::kInvalidArgument);
  EXPECT_EQ(city.engine().ContinueUpload(begun->id, half, {})->received_bytes, half);
  std::atomic<int> answers = 0;
  std::optional<Writer::Turn> turn = city.parts().writer->Take();
  const auto whole = city.engine().ContinueUpload(begun->id, half, bytes.subspan(half),
                                                  [&](const Result<AddOutcome>&) { ++answers; });
  ASSERT_OK(whole);
  EXPECT_EQ(whole->upload, 1u);
  EXPECT_TRUE(whole->is_in_line);
  const std::vector<UploadAnswer> waiting = *city.Ask().door().Uploads();
  ASSERT_EQ(waiting.size(), 1u);
  EXPECT_EQ(waiting[0].photo, HashContent(jpeg).Hex());
  EXPECT_EQ(CodeOf(city.engine().ContinueUpload(begun->id, half, bytes.subspan(half))),
            StatusCode::kAlreadyExists);
  turn.reset();
  city.Close();  // which finishes the photo at hand, or leaves it on the disk
  city.Open();
  EXPECT_EQ(city.Ask().door().PartialUpload(begun->id)->upload, 1u);
  EXPECT_EQ(city.Counts().images + city.Counts().uploads, 1u);
  EXPECT_EQ(answers, 1);
  EXPECT_TRUE(IsSound(city.Ask().snapshot()));
}

TEST(PartialUploadsOfTheDoor, AreRefusedWhereSomethingIsWrong) {
  City city;
  Engine& engine = city.engine();
  EXPECT_EQ(CodeOf(engine.BeginUpload(Request("1.jpg", 0), kRoomy)), StatusCode::kInvalidArgument);
  EXPECT_EQ(CodeOf(engine.BeginUpload(Request("1.jpg", 1ull << 50), kRoomy)),
            StatusCode::kInvalidArgument);
  PartialUploadRequest request = Request("1.jpg", 9);
  request.camera = "none";
  EXPECT_EQ(CodeOf(engine.BeginUpload(request, kRoomy)), StatusCode::kNotFound);
  request = Request("1.jpg", 9);
  request.contribution = 7;
  EXPECT_EQ(CodeOf(engine.BeginUpload(request, kRoomy)), StatusCode::kNotFound);
  for (const std::string& id : {std::string(), std::string("x"), std::string(32, 'g'),
                                std::string(32, '0'), std::string(64, '0')}) {
    EXPECT_EQ(CodeOf(engine.ContinueUpload(id, 0, Jpeg())), StatusCode::kNotFound);
    EXPECT_EQ(engine.AbandonUpload(id).code(), StatusCode::kNotFound);
    EXPECT_EQ(city.Ask().door().PartialUpload(id).status().code(), StatusCode::kNotFound);
  }
}

TEST(PartialUploadsOfTheDoor, AreNoMoreThanMayBe) {
  City city;
  Engine& engine = city.engine();
  PartialUploadLimits limits = {
      .count_max = 4, .bytes_max = 1'000, .count_each_max = 2, .bytes_each_max = 600};
  const auto begin = [&](uint64_t length, uint32_t token) {
    return engine.BeginUpload(Request("1.jpg", length, token), limits);
  };
  EXPECT_EQ(CodeOf(begin(601, 1)), StatusCode::kBusy);
  const auto first = begin(300, 1);
  ASSERT_OK(first);
  EXPECT_EQ(CodeOf(begin(301, 1)), StatusCode::kBusy) << "too many bytes of one";
  ASSERT_OK(begin(300, 1));
  EXPECT_EQ(CodeOf(begin(1, 1)), StatusCode::kBusy) << "too many of one";
  EXPECT_EQ(CodeOf(begin(401, 2)), StatusCode::kBusy) << "too many bytes in all";
  ASSERT_OK(begin(200, 2));
  ASSERT_OK(begin(200, 0));
  EXPECT_EQ(CodeOf(begin(1, 3)), StatusCode::kBusy) << "too many in all";
  ASSERT_OK(engine.AbandonUpload(first->id));
  ASSERT_OK(begin(1, 3));
  EXPECT_EQ(*engine.AbandonUploadsBefore(0), 0u);
  EXPECT_EQ(*engine.AbandonUploadsBefore(std::time(nullptr) + 10), 4u);
  ASSERT_OK(begin(600, 1));
  ExpectBounds<PartialUploadLimits>(&PartialUploadLimits::count_max, "count_max", {0u, 1'000'001u},
                                    {1u, 1'000'000u});
}

TEST(PartialUploadsOfTheDoor, GoWithTheirContributor) {
  City city;
  const auto begun = city.engine().BeginUpload(Request("1.jpg", 500), kRoomy);
  ASSERT_OK(begun);
  ASSERT_OK(city.engine().ContinueUpload(begun->id, 0, SampleBytes(1, 100)));
  RemoveRequest removal;
  removal.contributor = "bela";
  EXPECT_EQ(city.engine().Remove(removal).status().code(), StatusCode::kNotFound);
  removal.contributor = "anna";
  const auto removed = city.engine().Remove(removal);
  ASSERT_OK(removed);
  EXPECT_EQ(removed->uploads, 1u);
  EXPECT_TRUE(removed->purged.ok());
  EXPECT_EQ(city.Ask().door().PartialUpload(begun->id).status().code(), StatusCode::kNotFound);
}

}  // namespace
}  // namespace veduta
