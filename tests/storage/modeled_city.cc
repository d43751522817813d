// SPDX-License-Identifier: Apache-2.0
#include "tests/storage/modeled_city.h"

#include <gtest/gtest.h>

#include <array>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "storage/records/camera_record.h"
#include "storage/records/dense_settings.h"
#include "storage/records/depth_record.h"
#include "storage/records/image_record.h"
#include "storage/records/journal_record.h"
#include "storage/records/key_bytes.h"
#include "storage/records/pair_record.h"
#include "storage/records/photo_record.h"
#include "storage/records/point_block.h"
#include "storage/records/pose_record.h"
#include "storage/records/reconstruction_record.h"
#include "storage/records/record_parts.h"
#include "storage/records/state_record.h"
#include "storage/records/tile_record.h"
#include "storage/records/vocabulary_record.h"
#include "tests/storage/dense_samples.h"

namespace veduta {
namespace {

std::string TextOf(const StoredBytes& value) {
  return {reinterpret_cast<const char*>(value.bytes().data()), value.bytes().size()};
}

}  // namespace

Status ReadAll(const Snapshot& snapshot, Records* records) {
  Status failed;
  for (const FamilyTraits& traits : AllFamilies()) {
    const Status scanned = snapshot.ScanStored(
        traits.family, [&](std::string_view key, const Result<StoredBytes>& value) {
          if (value.ok()) (*records)[{traits.family, std::string(key)}] = TextOf(*value);
          if (!value.ok() && failed.ok()) failed = value.status();
          return true;
        });
    if (!scanned.ok() && failed.ok()) failed = scanned;
  }
  return failed;
}

std::string DifferenceOf(const Records& expected, const Records& stored) {
  std::string text;
  int count = 0;
  const auto tell = [&](const RecordKey& key, const char* what) {
    if (++count <= 5)
      text += std::string(FamilyName(key.first)) + " " + KeyText(key.second) + " " + what + "; ";
  };
  for (const auto& [key, value] : expected) {
    const auto found = stored.find(key);
    if (found == stored.end()) tell(key, "is missing");
    if (found != stored.end() && found->second != value) tell(key, "differs");
  }
  for (const auto& [key, value] : stored) {
    if (!expected.contains(key)) tell(key, "should not be there");
  }
  return count == 0 ? "" : std::to_string(count) + " records: " + text;
}

ModeledCity ModeledCity::New() {
  ModeledCity city;
  city.records[{Family::kMeta, std::string(kFormatKey)}] = EncodeU32(kFormatVersion);
  city.records[{Family::kMeta, std::string(kStateKey)}] = *Encode(city.state);
  return city;
}

class ModeledTransaction::Actions final {
 public:
  Actions(Database* database, const ModeledCity& before, SeededRandom* random)
      : database_(*database),
        transaction_(database->BeginTransaction()),
        after_(before),
        random_(*random) {}

  // Some actions; what the database holds after Commit is `after`, or as before.
  Status Run() {
    const uint32_t count = 1 + random_.Below(4);
    for (uint32_t i = 0; i < count; ++i) VEDUTA_RETURN_IF_ERROR(Act());
    AddJournal();
    PutState();
    return Status::Ok();
  }
  Status Commit() { return transaction_->Commit(); }
  const ModeledCity& after() const { return after_; }

 private:
  static constexpr ReconstructionId kTown{1};

  uint32_t ImageCount() const { return after_.state.next_image - 1; }
  uint32_t AnyImage() { return 1 + random_.Below(ImageCount()); }
  DatabaseCounts& Counts() { return *after_.state.counts; }

  void Put(Family family, const std::string& key, const Result<std::string>& value) {
    EXPECT_OK(value);
    if (value.ok()) after_.records[{family, key}] = *value;
  }
  void Erase(Family family, const std::string& key) { after_.records.erase({family, key}); }
  void ErasePrefix(Family family, const std::string& prefix) {
    std::erase_if(after_.records, [&](const auto& record) {
      return record.first.first == family && record.first.second.starts_with(prefix);
    });
  }

  Status Act() {
    if (ImageCount() < 2) return AddImage();
    switch (random_.Below(12)) {
      case 0:
        return PutCamera();
      case 1:
        return ChangeImage();
      case 2:
        return PutPair();
      case 3:
        return PutPose();
      case 4:
        return PutBlock();
      case 5:
        return PutGeneration();
      case 6:
        return PutVocabulary();
      case 7:
        return PutDepths();
      case 8:
        return PutTile();
      case 9:
        return DeleteDense();
      default:
        return AddImage();
    }
  }

  // Small ones mostly; some fill several pages, and blocks of the log.
  std::vector<uint8_t> AnyBytes(uint64_t seed) {
    constexpr std::array<uint32_t, 5> kSizes = {20, 90, 3000, 9000, 70'000};
    return SampleBytes(seed, kSizes[random_.Below(kSizes.size())] + random_.Below(50));
  }
  static std::string AsText(const std::vector<uint8_t>& bytes) {
    return {bytes.begin(), bytes.end()};
  }

  Status AddImage() {
    const uint32_t id = after_.state.next_image++;
    const ContentHash photo = SampleHash(after_.next_bytes);
    const std::vector<uint8_t> bytes = AnyBytes(after_.next_bytes);
    const Features features = SampleFeatures(after_.next_bytes++, 1 + random_.Below(12));
    VEDUTA_RETURN_IF_ERROR(database_.WritePhotoAhead(photo, bytes, features));
    ImageRecord image = SampleImage(id);
    image.photo = photo;
    image.verdict = random_.Below(2) == 0 ? Verdict::kPlaced : Verdict::kPostponed;
    image.reason = image.verdict == Verdict::kPlaced ? Reason::kRegistered : Reason::kNoGoodTriple;
    transaction_->PutImage(image);
    ++Counts().images;
    ++(image.verdict == Verdict::kPlaced ? Counts().placed : Counts().postponed);
    Put(Family::kImages, ImageKey(image.id), Encode(image));
    Put(Family::kNames, NameKey(image.name, image.contributor), EncodeU32(id));
    Put(Family::kHashes, HashKey(photo), EncodeU32(id));
    Put(Family::kPhotos, HashKey(photo), AsText(bytes));
    Put(Family::kFeatures, HashKey(photo), Encode(features));
    if (after_.state.vocabulary_generation != 0) PutWordsOf(image.id);
    return Status::Ok();
  }

  std::vector<WordId> WordsOf(ImageId image) const {
    return {image.value % 3, 3 + image.value % 4, 7 + image.value % 5};
  }
  void NotePostings(uint32_t generation, ImageId image) {
    for (const WordId word : WordsOf(image)) {
      std::set<ImageId>& images = after_.postings[word];
      images.insert(image);
      Put(Family::kPostings, PostingsKey(generation, word),
          EncodeImages(std::vector<ImageId>(images.begin(), images.end())));
    }
    Put(Family::kWords, WordsKey(generation, image), EncodeWords(WordsOf(image)));
  }
  void PutWordsOf(ImageId image) {
    const uint32_t generation = after_.state.vocabulary_generation;
    transaction_->PutWords(generation, image, WordsOf(image));
    transaction_->AddPostings(generation, WordsOf(image), image);
    NotePostings(generation, image);
  }

  Status PutCamera() {
    const CameraId id(1 + random_.Below(3));
    const CameraRecord camera{id, "camera", {1536, 1024, 1e3, 1e3, 768, 512}, "a guess"};
    if (!after_.records.contains({Family::kCameras, CameraKey(id)})) ++Counts().cameras;
    CameraRecord changed = camera;
    changed.model.k1 = random_.Unit() * 0.1;
    transaction_->PutCamera(changed);
    Put(Family::kCameras, CameraKey(id), Encode(changed));
    return Status::Ok();
  }

  Status ChangeImage() {
    const ImageId id(AnyImage());
    ImageRecord image;
    VEDUTA_RETURN_IF_ERROR(Decode(after_.records.at({Family::kImages, ImageKey(id)}), id, &image));
    --(image.verdict == Verdict::kPlaced ? Counts().placed : Counts().postponed);
    ++Counts().placed;
    image.verdict = Verdict::kPlaced;
    image.reason = Reason::kPropagated;
    image.detail = std::to_string(random_.Below(100)) + " points";
    transaction_->PutImage(image);
    Put(Family::kImages, ImageKey(id), Encode(image));
    return Status::Ok();
  }

  Status PutPair() {
    const uint32_t a = AnyImage();
    const uint32_t b = 1 + a % ImageCount();
    const PairRecord pair = SamplePair(std::min(a, b), std::max(a, b), 1 + random_.Below(60));
    const auto count = static_cast<uint32_t>(pair.matches.size());
    transaction_->PutPair(pair);
    Put(Family::kPairs, PairKey(pair.a, pair.b), Encode(pair));
    Put(Family::kPairs, NeighborKey(pair.a, pair.b),
        Encode(PairNeighbor{pair.b, count, pair.geometry}));
    Put(Family::kPairs, NeighborKey(pair.b, pair.a),
        Encode(PairNeighbor{pair.a, count, pair.geometry}));
    return Status::Ok();
  }

  Status PutPose() {
    const ImageId id(AnyImage());
    const PoseRecord pose{id, kTown, SamplePose(random_.Unit())};
    transaction_->PutPose(pose);
    Put(Family::kPoses, ImageKey(id), Encode(pose));
    std::vector<Observation> seen;
    for (uint32_t i = 0; i < random_.Below(4); ++i) seen.push_back({i, {id, i + 1}});
    transaction_->PutObservations(id, seen);
    if (seen.empty()) {
      Erase(Family::kObservations, ImageKey(id));
    } else {
      Put(Family::kObservations, ImageKey(id), Encode(std::span<const Observation>(seen)));
    }
    return Status::Ok();
  }

  Status PutBlock() {
    const PointBlock block = SampleBlock(AnyImage(), 1 + random_.Below(20));
    transaction_->PutPointBlock(kTown, after_.points_generation, block);
    Put(Family::kPoints, PointBlockKey(kTown, after_.points_generation, block.home), Encode(block));
    return Status::Ok();
  }

  // The points of a reconstruction that was adjusted: written ahead, and switched to.
  Status PutGeneration() {
    const uint32_t before = after_.points_generation, next = before + 1;
    transaction_->DeletePointBlocks(kTown, before);
    for (uint32_t id = 1; id <= ImageCount(); ++id)
      Erase(Family::kPoints, PointBlockKey(kTown, before, ImageId(id)));
    std::vector<PointBlock> blocks;
    for (uint32_t i = 0; i < 1 + random_.Below(4); ++i) {
      blocks.push_back(SampleBlock(AnyImage(), 1 + random_.Below(30)));
      Put(Family::kPoints, PointBlockKey(kTown, next, blocks.back().home), Encode(blocks.back()));
    }
    VEDUTA_RETURN_IF_ERROR(database_.WritePointBlocksAhead(kTown, next, blocks));
    const ReconstructionRecord record = SampleReconstruction(kTown.value, next);
    transaction_->PutReconstruction(record);
    Put(Family::kReconstructions, ReconstructionKey(kTown), Encode(record));
    after_.points_generation = next;
    return Status::Ok();
  }

  // One in a transaction, as the state names one.
  Status PutVocabulary() {
    if (std::exchange(has_vocabulary_, true)) return PutCamera();
    const uint32_t before = after_.state.vocabulary_generation, next = before + 1;
    transaction_->DeleteVocabulary(before);
    for (const Family family : {Family::kVocabulary, Family::kWords, Family::kPostings})
      ErasePrefix(family, VocabularyKey(before));
    after_.postings.clear();
    const std::vector<uint8_t> tree = AnyBytes(1000 + next);
    VEDUTA_RETURN_IF_ERROR(database_.WriteVocabularyAhead(next, tree));
    Put(Family::kVocabulary, VocabularyKey(next), AsText(tree));
    for (uint32_t id = 1; id <= ImageCount(); ++id) {
      VEDUTA_RETURN_IF_ERROR(database_.WriteWordsAhead(next, ImageId(id), WordsOf(ImageId(id))));
      NotePostings(next, ImageId(id));
    }
    for (const auto& [word, images] : after_.postings) {
      const std::vector<ImageId> list(images.begin(), images.end());
      VEDUTA_RETURN_IF_ERROR(database_.WritePostingsAhead(next, word, list));
    }
    after_.state.vocabulary_generation = next;
    return Status::Ok();
  }

  Status PutDepths() {
    DepthRecord depth = SampleDepth(AnyImage());
    depth.version = random_.Next();
    const DenseSettings settings{kCity, 0.05, 512, 2};
    transaction_->dense().PutSettings(settings);
    transaction_->dense().PutDepth(depth);
    transaction_->dense().PutDepthPixels(depth.image, SamplePixels());
    const CheckedDepthRecord checked = SampleChecked(depth.image.value, 1 + random_.Below(3));
    transaction_->dense().PutCheckedDepth(checked, SamplePixels());
    Put(Family::kDense, DenseSettingsKey(kCity), Encode(settings));
    Put(Family::kDense, DepthKey(depth.image), Encode(depth));
    Put(Family::kDepth, DepthKey(depth.image), Encode(SamplePixels()));
    Put(Family::kDense, CheckedDepthKey(checked.image, checked.version), Encode(checked));
    Put(Family::kDepth, CheckedDepthKey(checked.image, checked.version), Encode(SamplePixels()));
    return Status::Ok();
  }

  GridPlace AnyPlace() { return {static_cast<int32_t>(random_.Below(5)) - 2, 0, 1}; }

  Status PutTile() {
    const TileRecord tile = SampleTile(AnyPlace());
    const std::vector<uint8_t> voxels = AnyBytes(random_.Below(99)), mesh = AnyBytes(7);
    transaction_->dense().PutTile(tile);
    transaction_->dense().PutVolumeBlock(kCity, tile.place, 63, voxels);
    transaction_->dense().PutSurface(SurfacePart::kMesh, kCity, tile.place, mesh);
    Put(Family::kDense, TileKey(kCity, tile.place), Encode(tile));
    Put(Family::kVolume, VolumeKey(kCity, tile.place, 63), AsText(voxels));
    Put(Family::kSurface, SurfaceKey(SurfacePart::kMesh, kCity, tile.place), AsText(mesh));
    return Status::Ok();
  }

  Status DeleteDense() {
    const GridPlace place = AnyPlace();
    transaction_->dense().DeleteTile(kCity, place);
    Erase(Family::kDense, TileKey(kCity, place));
    Erase(Family::kVolume, VolumeKey(kCity, place, 63));
    Erase(Family::kSurface, SurfaceKey(SurfacePart::kMesh, kCity, place));
    const ImageId image(AnyImage());
    transaction_->dense().DeleteDepth(image);
    Erase(Family::kDense, DepthKey(image));
    Erase(Family::kDepth, DepthKey(image));
    return Status::Ok();
  }

  void AddJournal() {
    const JournalRecord entry{
        after_.state.next_journal++, 1'700'000'000, "anna", "add", {}, {}, ""};
    transaction_->AddJournal(entry);
    Put(Family::kJournal, JournalKey(entry.sequence), Encode(entry));
  }
  void PutState() {
    transaction_->PutState(after_.state);
    Put(Family::kMeta, std::string(kStateKey), Encode(after_.state));
  }

  Database& database_;
  const std::unique_ptr<Transaction> transaction_;
  ModeledCity after_;
  SeededRandom& random_;
  bool has_vocabulary_ = false;
};

ModeledTransaction::ModeledTransaction(Database* database, const ModeledCity& before,
                                       SeededRandom* random)
    : actions_(std::make_unique<Actions>(database, before, random)) {}
ModeledTransaction::~ModeledTransaction() = default;

Status ModeledTransaction::Run() {
  return actions_->Run();
}
Status ModeledTransaction::Commit() {
  return actions_->Commit();
}
const ModeledCity& ModeledTransaction::after() const {
  return actions_->after();
}

}  // namespace veduta
