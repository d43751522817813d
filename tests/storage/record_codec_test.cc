// SPDX-License-Identifier: Apache-2.0
// Goal: every record comes back as it was stored; a damaged value is kCorruption and never a
//   crash or a record that breaks its invariants; a record that breaks them is not encoded.
// Method: round trips of full, empty and extreme records at every alignment; bytes of encoded
//   values flipped, cut, extended and replaced at seeded places, then decoded, and what decodes
//   is encoded again.
#include "storage/record_codec.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "samples.h"

namespace veduta {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr uint32_t kMax = std::numeric_limits<uint32_t>::max();

// `value` at a chosen distance from an 8-byte boundary, followed by nothing that belongs to it.
class Shifted final {
 public:
  Shifted(std::string_view value, size_t shift)
      : memory_(value.size() / 8 + 3), shift_(shift), size_(value.size()) {
    std::memcpy(reinterpret_cast<char*>(memory_.data()) + shift, value.data(), value.size());
  }
  std::string_view view() const {
    return {reinterpret_cast<const char*>(memory_.data()) + shift_, size_};
  }

 private:
  std::vector<uint64_t> memory_;
  size_t shift_, size_;
};

// Encodes, decodes at all eight alignments, and encodes again: equal bytes mean that every stored
// field came back.
template <typename Record, typename... Ids>
void RoundTrip(const Record& record, Record* decoded, Ids... ids) {
  const Result<std::string> value = Encode(record);
  ASSERT_OK(value);
  for (size_t shift = 0; shift < 8; ++shift) {
    ASSERT_OK(Decode(Shifted(*value, shift).view(), ids..., decoded));
    const Result<std::string> again = Encode(*decoded);
    ASSERT_OK(again);
    ASSERT_EQ(*again, *value) << "shift " << shift;
  }
}

TEST(RecordCodec, State) {
  DatabaseState decoded;
  RoundTrip(SampleState(12), &decoded);
  EXPECT_EQ(decoded, SampleState(12));
  RoundTrip(DatabaseState{}, &decoded);
  EXPECT_EQ(decoded, DatabaseState{});
  DatabaseState extreme = SampleState(kMax);
  extreme.next_journal = extreme.next_blob = std::numeric_limits<uint64_t>::max();
  extreme.pending_propagation.assign(100'000, ImageId(kMax));
  RoundTrip(extreme, &decoded);
  EXPECT_EQ(decoded, extreme);
}

TEST(RecordCodec, Camera) {
  CameraRecord camera{CameraId(kMax),
                      "Nikon \xFF\xC3 not UTF-8",
                      {1, 2, 3.5, 4, 5, 6, -7, 8, 9, -0.0},
                      std::string("a\0b", 3)};
  CameraRecord decoded;
  RoundTrip(camera, &decoded, camera.id);
  EXPECT_EQ(decoded.id, camera.id);
  EXPECT_EQ(decoded.name, camera.name);
  EXPECT_EQ(decoded.source, camera.source);
  EXPECT_EQ(decoded.model, camera.model);
  CameraRecord empty;
  empty.id = CameraId(1);
  RoundTrip(empty, &decoded, empty.id);
  EXPECT_EQ(decoded.name, "");
  EXPECT_EQ(decoded.model, CameraModel{});
}

TEST(RecordCodec, Image) {
  const ImageRecord image = SampleImage(9);
  ImageRecord decoded;
  RoundTrip(image, &decoded, image.id);
  EXPECT_EQ(decoded.name, image.name);
  EXPECT_EQ(decoded.photo, image.photo);
  EXPECT_EQ(decoded.camera, image.camera);
  EXPECT_EQ(decoded.width_px, image.width_px);
  EXPECT_EQ(decoded.height_px, image.height_px);
  EXPECT_EQ(decoded.size_bytes, image.size_bytes);
  EXPECT_EQ(decoded.feature_count, image.feature_count);
  EXPECT_EQ(decoded.contributor, image.contributor);
  EXPECT_EQ(decoded.time_unix_s, image.time_unix_s);
  EXPECT_EQ(decoded.verdict, image.verdict);
  EXPECT_EQ(decoded.reason, image.reason);
  EXPECT_EQ(decoded.detail, image.detail);
  ImageRecord extreme;
  extreme.id = ImageId(kMax);
  extreme.name.assign(100'000, 'n');
  extreme.time_unix_s = std::numeric_limits<int64_t>::min();
  RoundTrip(extreme, &decoded, extreme.id);
  EXPECT_EQ(decoded.time_unix_s, extreme.time_unix_s);
  EXPECT_EQ(decoded.name, extreme.name);
}

TEST(RecordCodec, Features) {
  for (const size_t count : {0, 1, 2, 5000}) {
    const Features features = SampleFeatures(count, count);
    Features decoded;
    RoundTrip(features, &decoded);
    EXPECT_EQ(decoded.keypoints, features.keypoints);
    EXPECT_EQ(decoded.descriptors, features.descriptors);
  }
}

TEST(RecordCodec, Pair) {
  for (const size_t count : {0, 1, 1501}) {
    const PairRecord pair = SamplePair(3, kMax, count);
    PairRecord decoded;
    RoundTrip(pair, &decoded, pair.a, pair.b);
    EXPECT_EQ(decoded.a, pair.a);
    EXPECT_EQ(decoded.b, pair.b);
    EXPECT_EQ(decoded.geometry, pair.geometry);
    EXPECT_EQ(decoded.matches, pair.matches);
    EXPECT_EQ(decoded.b_from_a.rotation.coeffs(), pair.b_from_a.rotation.coeffs());
    EXPECT_EQ(decoded.b_from_a.translation, pair.b_from_a.translation);
  }
  PairNeighbor decoded;
  RoundTrip(PairNeighbor{ImageId(5), kMax, PairGeometry::kRotation}, &decoded, ImageId(5));
  EXPECT_EQ(decoded.image, ImageId(5));
  EXPECT_EQ(decoded.match_count, kMax);
  EXPECT_EQ(decoded.geometry, PairGeometry::kRotation);
}

TEST(RecordCodec, Reconstruction) {
  const ReconstructionRecord record = SampleReconstruction(8, kMax);
  ReconstructionRecord decoded;
  RoundTrip(record, &decoded, record.id);
  EXPECT_EQ(decoded.id, record.id);
  EXPECT_EQ(decoded.merged_into, record.merged_into);
  EXPECT_EQ(decoded.merged_from_this.scale, record.merged_from_this.scale);
  EXPECT_EQ(decoded.merged_from_this.rotation.coeffs(), record.merged_from_this.rotation.coeffs());
  EXPECT_EQ(decoded.merged_from_this.translation, record.merged_from_this.translation);
  EXPECT_EQ(decoded.image_count, record.image_count);
  EXPECT_EQ(decoded.point_count, record.point_count);
  EXPECT_EQ(decoded.observation_count, record.observation_count);
  EXPECT_EQ(decoded.reprojection_error_px_sum, record.reprojection_error_px_sum);
  EXPECT_EQ(decoded.geometry_version, record.geometry_version);
  EXPECT_EQ(decoded.points_generation, record.points_generation);
  EXPECT_EQ(decoded.images_at_adjustment, record.images_at_adjustment);
}

TEST(RecordCodec, PoseAndObservations) {
  SeededRandom random(1);
  const PoseRecord pose{ImageId(4), ReconstructionId(2), SampleRigid(&random)};
  PoseRecord decoded;
  RoundTrip(pose, &decoded, pose.image);
  EXPECT_EQ(decoded.image, pose.image);
  EXPECT_EQ(decoded.reconstruction, pose.reconstruction);
  EXPECT_EQ(decoded.cam_from_world.rotation.coeffs(), pose.cam_from_world.rotation.coeffs());
  EXPECT_EQ(decoded.cam_from_world.translation, pose.cam_from_world.translation);

  const std::vector<Observation> rows = {
      {0, {ImageId(1), 1}}, {5, {ImageId(kMax), kMax}}, {kMax, {ImageId(2), 3}}};
  for (size_t count = 0; count <= rows.size(); ++count) {
    const std::span<const Observation> some(rows.data(), count);
    const Result<std::string> value = Encode(some);
    ASSERT_OK(value);
    std::vector<Observation> read;
    ASSERT_OK(Decode(*value, &read));
    EXPECT_EQ(read, std::vector<Observation>(some.begin(), some.end()));
  }
}

TEST(RecordCodec, PointBlock) {
  for (const size_t count : {0, 1, 1200}) {
    const PointBlock block = SampleBlock(6, count);
    PointBlock decoded;
    RoundTrip(block, &decoded, block.home);
    EXPECT_EQ(decoded.home, block.home);
    EXPECT_EQ(decoded.next_ordinal, block.next_ordinal);
    ASSERT_EQ(decoded.points.size(), count);
    for (size_t i = 0; i < count; ++i) {
      EXPECT_EQ(decoded.points[i].id, block.points[i].id);
      EXPECT_EQ(decoded.points[i].position, block.points[i].position);
      EXPECT_EQ(decoded.points[i].rgb, block.points[i].rgb);
      EXPECT_EQ(decoded.points[i].error_px, block.points[i].error_px);
      EXPECT_EQ(decoded.points[i].track, block.points[i].track);
    }
  }
}

TEST(RecordCodec, Journal) {
  const JournalRecord record{std::numeric_limits<uint64_t>::max(),
                             -5,
                             "veduta",
                             "merge",
                             ImageId(3),
                             ReconstructionId(4),
                             "2 into 1"};
  JournalRecord decoded;
  RoundTrip(record, &decoded, record.sequence);
  EXPECT_EQ(decoded.sequence, record.sequence);
  EXPECT_EQ(decoded.time_unix_s, record.time_unix_s);
  EXPECT_EQ(decoded.actor, record.actor);
  EXPECT_EQ(decoded.action, record.action);
  EXPECT_EQ(decoded.image, record.image);
  EXPECT_EQ(decoded.reconstruction, record.reconstruction);
  EXPECT_EQ(decoded.detail, record.detail);
}

TEST(RecordCodec, RawArrays) {
  std::vector<WordId> words;
  ASSERT_OK(DecodeWords(*EncodeWords(std::vector<WordId>{0, 1, kMax}), &words));
  EXPECT_EQ(words, (std::vector<WordId>{0, 1, kMax}));
  ASSERT_OK(DecodeWords("", &words));
  EXPECT_TRUE(words.empty());
  EXPECT_EQ(DecodeWords("abc", &words).code(), StatusCode::kCorruption);
  EXPECT_EQ(EncodeWords(std::vector<WordId>{1, 1}).status().code(), StatusCode::kInvalidArgument);
  std::vector<ImageId> images;
  EXPECT_EQ(DecodeImages(std::string(4, '\0'), &images).code(), StatusCode::kCorruption)
      << "image id 0";
  EXPECT_EQ(DecodeImages(EncodeU32(5) + EncodeU32(4), &images).code(), StatusCode::kCorruption)
      << "descending";
  uint32_t number = 0;
  EXPECT_EQ(DecodeU32("abcde", &number).code(), StatusCode::kCorruption);
}

template <typename Record>
void ExpectRefused(const Record& record, const std::string& word) {
  const Result<std::string> value = Encode(record);
  ASSERT_FALSE(value.ok()) << word;
  EXPECT_EQ(value.status().code(), StatusCode::kInvalidArgument);
  EXPECT_NE(value.status().message().find(word), std::string::npos) << value.status().message();
}

TEST(RecordCodec, RefusesToWriteWhatItCouldNotRead) {
  PoseRecord pose{ImageId(1), ReconstructionId(1), Rigid3()};
  pose.cam_from_world.translation.y() = kNan;
  ExpectRefused(pose, "translation");
  pose.cam_from_world = Rigid3();
  pose.cam_from_world.rotation.coeffs() *= 1.1;
  ExpectRefused(pose, "rotation");

  PointBlock block = SampleBlock(1, 3);
  block.points[1].track.resize(1);
  ExpectRefused(block, "track length");
  block = SampleBlock(1, 3);
  block.next_ordinal = 5;
  ExpectRefused(block, "next_ordinal");
  block = SampleBlock(1, 3);
  std::swap(block.points[0], block.points[1]);
  ExpectRefused(block, "ascending");
  block = SampleBlock(1, 3);
  block.points[2].position.z() = std::numeric_limits<double>::infinity();
  ExpectRefused(block, "position");

  Features features = SampleFeatures(1, 4);
  features.descriptors.pop_back();
  ExpectRefused(features, "descriptors");
  features = SampleFeatures(1, 4);
  features.keypoints[3].angle_deg = static_cast<float>(kNan);
  ExpectRefused(features, "keypoint");

  PairRecord pair = SamplePair(1, 2, 3);
  std::swap(pair.matches[0], pair.matches[2]);
  ExpectRefused(pair, "matches");
  pair = SamplePair(2, 2, 3);
  ExpectRefused(pair, "greater than a");
  pair = SamplePair(1, 2, 3);
  pair.geometry = static_cast<PairGeometry>(9);
  ExpectRefused(pair, "geometry");

  ImageRecord image = SampleImage(1);
  image.verdict = static_cast<Verdict>(0);
  ExpectRefused(image, "verdict");
  image = SampleImage(1);
  image.reason = static_cast<Reason>(5);
  ExpectRefused(image, "reason");

  CameraRecord camera;
  ExpectRefused(camera, "camera");
  camera.id = CameraId(1);
  camera.model.k2 = kNan;
  ExpectRefused(camera, "k2");

  ReconstructionRecord reconstruction = SampleReconstruction(1, 1);
  reconstruction.merged_from_this.scale = 0;
  ExpectRefused(reconstruction, "scale");
}

// Damages `value` in one of several ways.
std::string Damage(std::string value, SeededRandom* random) {
  switch (random->Below(5)) {
    case 0:
      for (uint32_t i = 0; i <= random->Below(4); ++i) {
        value[random->Below(static_cast<uint32_t>(value.size()))] ^=
            static_cast<char>(1u << random->Below(8));
      }
      break;
    case 1:  // where the pointers are
      value[random->Below(std::min<uint32_t>(static_cast<uint32_t>(value.size()), 128))] ^=
          static_cast<char>(1 + random->Below(255));
      break;
    case 2:
      value.resize(random->Below(static_cast<uint32_t>(value.size())));
      break;
    case 3:
      value.append(1 + random->Below(20), static_cast<char>(random->Next()));
      break;
    default: {  // a word of its own choosing
      const uint64_t word = random->Next();
      std::memcpy(value.data() + 8 * random->Below(static_cast<uint32_t>(value.size() / 8)), &word,
                  8);
    }
  }
  return value;
}

// What decodes in spite of the damage must be a record that can be encoded.
template <typename Record, typename... Ids>
void Fuzz(const Record& record, Ids... ids) {
  const std::string value = *Encode(record);
  size_t corrupt = 0;
  constexpr size_t kRounds = 3000;
  for (size_t seed = 0; seed < kRounds; ++seed) {
    SeededRandom random(seed);
    const std::string damaged = Damage(value, &random);
    Record decoded;
    // An exact heap copy, so that the address sanitizer sees a read past its end.
    const std::vector<char> bytes(damaged.begin(), damaged.end());
    const Status status = Decode(std::string_view(bytes.data(), bytes.size()), ids..., &decoded);
    if (status.ok()) {
      ASSERT_OK(Encode(decoded)) << "seed " << seed;
    } else {
      ASSERT_EQ(status.code(), StatusCode::kCorruption) << status.message();
      ASSERT_FALSE(status.message().empty());
      ++corrupt;
    }
  }
  // Two kinds of damage in five change the length, and are always noticed.
  EXPECT_GT(corrupt, kRounds * 3 / 10);
}

TEST(RecordCodec, DamagedValuesAreCorruption) {
  SeededRandom random(1);
  Fuzz(SampleState(5));
  CameraRecord camera{CameraId(1), "Nikon", {1, 2, 3, 4, 5, 6, 7, 8, 9, 10}, "by hand"};
  Fuzz(camera, CameraId(1));
  Fuzz(SampleImage(3), ImageId(3));
  Fuzz(SampleFeatures(1, 3));
  Fuzz(SamplePair(1, 2, 5), ImageId(1), ImageId(2));
  Fuzz(PairNeighbor{ImageId(1), 4, PairGeometry::kGeneral}, ImageId(1));
  Fuzz(SampleReconstruction(1, 2), ReconstructionId(1));
  Fuzz(PoseRecord{ImageId(4), ReconstructionId(2), SampleRigid(&random)}, ImageId(4));
  Fuzz(SampleBlock(3, 4), ImageId(3));
  Fuzz(JournalRecord{1, 2, "a", "add", ImageId(3), ReconstructionId(4), "d"}, uint64_t{1});
  Fuzz(std::vector<Observation>{{1, {ImageId(1), 1}}, {2, {ImageId(2), 2}}});
}

TEST(RecordCodec, EveryCutIsCorruption) {
  const std::string value = *Encode(SampleBlock(3, 4));
  for (size_t size = 0; size < value.size(); ++size) {
    PointBlock block;
    EXPECT_EQ(Decode(std::string_view(value).substr(0, size), ImageId(3), &block).code(),
              StatusCode::kCorruption)
        << size;
  }
}

}  // namespace
}  // namespace veduta
