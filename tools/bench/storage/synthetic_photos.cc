// SPDX-License-Identifier: Apache-2.0
#include "tools/bench/storage/synthetic_photos.h"

#include <algorithm>
#include <set>
#include <string>
#include <vector>

namespace veduta::bench {
namespace {

constexpr ReconstructionId kReconstruction(1);
constexpr uint32_t kWordCount = 100'000;

std::vector<uint8_t> RandomBytes(SeededRandom& random, size_t size) {
  std::vector<uint8_t> bytes(size);
  for (uint8_t& byte : bytes) byte = static_cast<uint8_t>(random.Next());
  return bytes;
}

Features RandomFeatures(SeededRandom& random, uint32_t count) {
  Features features;
  for (uint32_t i = 0; i < count; ++i) {
    Keypoint keypoint;
    keypoint.x_px = static_cast<float>(random.Unit() * 1536);
    keypoint.y_px = static_cast<float>(random.Unit() * 1024);
    keypoint.scale_px = static_cast<float>(1 + random.Unit() * 20);
    keypoint.angle_deg = static_cast<float>(random.Unit() * 360);
    keypoint.response = static_cast<float>(random.Unit());
    keypoint.contrast_sign = 1;
    features.keypoints.push_back(keypoint);
  }
  features.descriptors = RandomBytes(random, size_t{count} * kDescriptorSize);
  return features;
}

PairRecord RandomPair(SeededRandom& random, uint32_t a, uint32_t b, const PhotoSizes& sizes) {
  PairRecord pair;
  pair.a = ImageId(a);
  pair.b = ImageId(b);
  pair.geometry = PairGeometry::kGeneral;
  for (uint32_t i = 0; i < sizes.matches; ++i)
    pair.matches.push_back({i * (sizes.features / sizes.matches), random.Below(sizes.features)});
  return pair;
}

PointBlock RandomBlock(SeededRandom& random, uint32_t home, uint32_t count) {
  PointBlock block;
  block.home = ImageId(home);
  for (uint32_t i = 0; i < count; ++i) {
    PointRecord point;
    point.id = {ImageId(home), i + 1};
    point.position = {random.Unit() * 100, random.Unit() * 100, random.Unit() * 10};
    point.error_px = 0.5F;
    point.track = {{ImageId(home), i}, {ImageId(home + 1), i}, {ImageId(home + 2), i}};
    block.points.push_back(point);
  }
  block.next_ordinal = count + 1;
  return block;
}

ImageRecord ImageOf(uint32_t id, const ContentHash& photo, const PhotoSizes& sizes) {
  ImageRecord image;
  image.id = ImageId(id);
  image.name = "street/" + std::to_string(id) + ".jpg";
  image.photo = photo;
  image.camera = CameraId(1);
  image.width_px = 1536;
  image.height_px = 1024;
  image.size_bytes = sizes.photo_bytes;
  image.feature_count = sizes.features;
  image.verdict = Verdict::kPlaced;
  image.reason = Reason::kRegistered;
  return image;
}

void PutPlace(Transaction& transaction, SeededRandom& random, uint32_t id,
              const PhotoSizes& sizes) {
  transaction.PutPose({ImageId(id), kReconstruction, Rigid3()});
  std::vector<Observation> observations;
  for (uint32_t i = 0; i < sizes.points; ++i) observations.push_back({i, {ImageId(id), i + 1}});
  transaction.PutObservations(ImageId(id), observations);
  transaction.PutPointBlock(kReconstruction, 1, RandomBlock(random, id, sizes.points));
  for (uint32_t i = 1; i <= sizes.touched_blocks && i < id; ++i)
    transaction.PutPointBlock(kReconstruction, 1, RandomBlock(random, id - i, sizes.points));
  for (uint32_t i = 1; i <= sizes.neighbors && i < id; ++i)
    transaction.PutPair(RandomPair(random, id - i, id, sizes));
}

}  // namespace

Status AddSyntheticPhoto(Database& database, uint32_t id, const PhotoSizes& sizes) {
  SeededRandom random(id);
  const std::vector<uint8_t> bytes = RandomBytes(random, sizes.photo_bytes);
  const ContentHash photo = HashContent(bytes);
  VEDUTA_RETURN_IF_ERROR(
      database.WritePhotoAhead(photo, bytes, RandomFeatures(random, sizes.features)));
  const auto transaction = database.BeginTransaction();
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, transaction->base()->GetState());
  state.next_image = id + 1;
  transaction->PutImage(ImageOf(id, photo, sizes));
  PutPlace(*transaction, random, id, sizes);
  std::set<WordId> words;
  while (words.size() < sizes.words) words.insert(random.Below(kWordCount));
  const std::vector<WordId> list(words.begin(), words.end());
  transaction->PutWords(1, ImageId(id), list);
  transaction->AddPostings(1, list, ImageId(id));
  transaction->AddJournal({id, 0, "bench", "add", ImageId(id), {}, ""});
  transaction->PutState(state);
  return transaction->Commit();
}

}  // namespace veduta::bench
