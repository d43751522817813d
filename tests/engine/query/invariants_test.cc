// SPDX-License-Identifier: Apache-2.0
// Goal: the checks notice all damage that changes the digest, except in the fields that FORMAT.md
//   lists as free; a value that cannot be read does not keep the others from being checked.
// Method: a database of photos of a street with every kind of record; each field of each record
//   changed to another legal value, values flipped, cut, lengthened, exchanged, removed and added,
//   one at a time; the share that is noticed is printed for each family and field.
#include "engine/query/invariants.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "engine/query/digest.h"
#include "storage/records/point_block.h"
#include "tests/engine/query/field_damage.h"
#include "tests/engine/street_fixture.h"
#include "tests/storage/stored_families.h"

namespace veduta {
namespace {

// Fields of the digest that nothing else determines; FORMAT.md lists them, and says why.
const std::set<std::string> kFree = {
    "cameras.refinedFromFx",  // this and the next three where k1 and k2 are 0
    "cameras.refinedFromFy",
    "cameras.u0",
    "cameras.v0",
    "images.camera",  // this and the next six of rejected photos, which are not kept
    "images.featureCount",
    "images.heightPx",
    "images.photo",
    "images.reason within its verdict",  // and of postponed ones
    "images.sizeBytes",
    "images.widthPx",
    "images.detail",            // of postponed photos
    "meta.hypothesis: aFromB",  // this and the others: only judging it anew tells them
    "meta.border: evidence",
    "meta.border: fragments",
    "meta.border: views",
    "meta.hypothesis: aFromBScale",
    "meta.hypothesis: agreeingMatches",
    "meta.hypothesis: agreeingPairs",
    "meta.hypothesis: commonPointCount",
    "meta.hypothesis: contradictingMatches",
    "meta.hypothesis: contradictingPairs",
    "meta.hypothesis: due",
    "meta.hypothesis: image",
    "meta.hypothesis: images, one less",
    "meta.hypothesis: judgedCells",
    "meta.hypothesis: judgmentCount",
    "meta.hypothesis: loopImages",
    "meta.hypothesis: missingCells",
    "meta.hypothesis: reason",
    "meta.hypothesis: unsure",
    "meta.pendingPropagation",
    "meta.submap: imagesAtAdjustment",
    "meta.submap: motion",
    "points.colors",
    "points.nextOrdinal",
    "reconstructions.mergedFromThis: rotation",
    "reconstructions.mergedFromThis: translation",
    "reconstructions.mergedFromThisScale",
};
// Fields that only features extracted from the photo again determine.
const std::set<std::string> kDeep = {
    "cameras.k1",
    "cameras.k2",
    "features.descriptors: all of one",
    "features.descriptors: one byte",
    "features.keypoints: angle of one",
    "features.keypoints: response of the last, to less",
    "features.keypoints: scale of one",
    "features.keypoints: sign of one",
    "features.keypoints: x of one",
    "features.keypoints: y of one",
};
// Families of which no byte is free. The others have free fields, and numbers of which the last
// digits are lost in what is measured by them.
const std::set<Family> kDeterminedToTheByte = {
    Family::kNames, Family::kHashes,   Family::kPhotos,    Family::kObservations,
    Family::kWords, Family::kPostings, Family::kVocabulary};

// A second reconstruction, which was merged into the first.
void AddMerged(City* city) {
  const auto transaction = city->parts().database->BeginTransaction();
  auto state = transaction->base()->GetState();
  ASSERT_OK(state);
  ReconstructionRecord merged;
  merged.id = ReconstructionId(state->next_reconstruction++);
  merged.merged_into = ReconstructionId(1);
  merged.merged_from_this.scale = 2;
  merged.points_generation = 1;
  merged.images_at_adjustment = 3;
  transaction->PutReconstruction(merged);
  transaction->PutState(*state);
  ASSERT_OK(transaction->Commit());
}

// A merge of the two that live, which was not believed.
void AddHypothesis(City* city) {
  HypothesisRecord hypothesis;
  hypothesis.a = ReconstructionId(1);
  hypothesis.b = ReconstructionId(2);
  hypothesis.common_point_count = 21;
  hypothesis.judged_cells = 30;
  hypothesis.missing_cells = 20;
  hypothesis.image = ImageId(2);
  hypothesis.images = {ImageId(1), ImageId(2)};
  const auto transaction = city->parts().database->BeginTransaction();
  transaction->PutHypothesis(hypothesis);
  ASSERT_OK(transaction->Commit());
}

// The second one in two submaps.
void AddSubmaps(City* city) {
  std::vector<ImageId> images;
  const auto transaction = city->parts().database->BeginTransaction();
  ASSERT_OK(transaction->base()->ScanPoses([&](const PoseRecord& pose) {
    if (pose.reconstruction == ReconstructionId(2)) images.push_back(pose.image);
    return true;
  }));
  ASSERT_GE(images.size(), 4u);
  const auto middle = images.begin() + 2;
  transaction->PutSubmap({SubmapId(1), ReconstructionId(2), {images.begin(), middle}, 2});
  transaction->PutSubmap({SubmapId(2), ReconstructionId(2), {middle, images.end()}, 1});
  SubmapBorder border;
  border.id = SubmapId(2);
  border.views = {{0, images[0], 1, 2}, {0, images[2], 3, 4}};
  border.evidence = {{images[2], images[0], 5, 0, 0, 0}};
  border.fragments = {{images[2], images[2]}};
  transaction->PutSubmapBorder(border);
  ASSERT_OK(transaction->Commit());
}

// Every kind of record: two cameras and contributors, photos that are placed, founded, postponed
// and rejected, two reconstructions with a hypothesis that they are one, one of them in submaps,
// another that was merged away, and a vocabulary.
void Fill(City* city) {
  CameraModel second = StreetCameraModel();
  second.fx += 0.3;
  ASSERT_OK(city->engine().AddCamera("second", second, "nearly the truth"));
  std::vector<PhotoSubmission> photos;
  for (const Stand& stand : Walk(6, 1.1, 6)) photos.push_back(city->Submit(stand));
  photos.push_back(city->Submit(Stand{60, 90}));
  for (const Stand& stand : Walk(30, 1.1, 4)) photos.push_back(city->Submit(stand));
  photos.push_back(city->Submit("blank.jpg", {1, 2, 3}));
  for (size_t i = 0; i < photos.size(); i += 3) photos[i].contributor = "bert";
  photos[1].camera = "second";
  const auto outcomes = city->Add(photos);
  const auto snapshot = city->parts().database->GetSnapshot();
  std::set<Verdict> verdicts;
  ASSERT_OK(snapshot->ScanImages([&](const ImageRecord& image) {
    verdicts.insert(image.verdict);
    return true;
  }));
  EXPECT_EQ(verdicts, (std::set{Verdict::kPlaced, Verdict::kFounded, Verdict::kPostponed,
                                Verdict::kRejected}))
      << Told(outcomes);
  ASSERT_EQ(city->Counts().reconstructions.size(), 2u) << Told(outcomes);
  AddHypothesis(city);
  AddSubmaps(city);
  AddMerged(city);
}

struct Share {
  size_t tried = 0, noticed = 0, harmless = 0;
  std::vector<std::string> noticed_deeply, silent;  // where
};

class InvariantsTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    CityOptions options = City::Options(2);
    options.ingest.retrieval.compare_all_max = 5;
    options.prepare.features.feature_count_max = 1200;
    city_ = new City(options);
    Fill(city_);
    city_->Close();
    stored_ = new StoredFamilies(city_->path());
    const auto digest = DigestOf(*stored_->GetSnapshot());
    ASSERT_OK(digest);
    digest_ = *digest;
    tables_ = new UndistortCache(options.undistort_cache_bytes);
    preparer_ = new PhotoPreparer(nullptr, tables_, options.prepare);
  }
  static void TearDownTestSuite() {
    delete preparer_;
    delete tables_;
    delete stored_;
    delete city_;
  }

  static bool IsNoticed(const Snapshot& snapshot, bool deep) {
    const auto violations = FindViolations(
        snapshot,
        CheckOptions{.count_max = 1, .deep = deep, .preparer = deep ? preparer_ : nullptr});
    EXPECT_OK(violations);
    return violations.ok() && !violations->empty();
  }

  // How the damage that is done now is noticed; puts it back.
  void Judge(const std::string& what, const std::string& where) {
    Share& share = shares_[what];
    ++share.tried;
    const auto snapshot = stored_->GetSnapshot();
    if (IsNoticed(*snapshot, false)) {
      ++share.noticed;
    } else if (const auto digest = DigestOf(*snapshot); digest.ok() && *digest == digest_) {
      ++share.harmless;
    } else {
      (looks_deeply_ && IsNoticed(*snapshot, true) ? share.noticed_deeply : share.silent)
          .push_back(where);
    }
    stored_->PutBack();
  }

  void Report() const {
    for (const auto& [what, share] : shares_) {
      std::printf("%-52s of %3zu: noticed %3zu, deeply %3zu, same digest %3zu, silent %3zu\n",
                  what.c_str(), share.tried, share.noticed, share.noticed_deeply.size(),
                  share.harmless, share.silent.size());
    }
  }
  static void ExpectOnlyIn(const std::set<std::string>& known, const std::string& what,
                           const std::vector<std::string>& missed) {
    if (missed.empty() || known.contains(what)) return;
    ADD_FAILURE() << what << " at " << missed.front() << " and " << missed.size() - 1
                  << " others changes the digest, and is not noticed";
  }

  // The first, the last, and some between.
  static std::vector<std::string> SomeKeys(Family family, size_t count) {
    const std::vector<std::string> keys = stored_->Keys(family);
    std::set<std::string> some;
    for (size_t i = 0; i < count && !keys.empty(); ++i)
      some.insert(keys[i * (keys.size() - 1) / std::max<size_t>(1, count - 1)]);
    return {some.begin(), some.end()};
  }

  // Changes what `change` makes of keys and values of every family.
  using Change = std::function<bool(Family family, const std::string& key)>;
  void ChangeEach(const std::string& what, size_t count, const Change& change) {
    for (const FamilyTraits& traits : AllFamilies()) {
      for (const std::string& key : SomeKeys(traits.family, count)) {
        if (change(traits.family, key))
          Judge(traits.name + (": " + what), PlaceOf(traits.family, key));
      }
    }
  }

  // A point block that has lost all its points keeps nothing but `nextOrdinal`, which is free.
  static bool HoldsNoPoint(const std::string& key) {
    uint32_t home = 0;
    for (const char byte : key.substr(key.size() - 4))
      home = home << 8 | static_cast<uint8_t>(byte);
    PointBlock block;
    EXPECT_OK(Decode(*stored_->Get(Family::kPoints, key), ImageId(home), &block));
    return block.points.empty();
  }

  static City* city_;
  static StoredFamilies* stored_;
  static UndistortCache* tables_;
  static PhotoPreparer* preparer_;
  static ContentHash digest_;
  std::map<std::string, Share> shares_;
  bool looks_deeply_ = true;  // takes half a second for each damage
};
City* InvariantsTest::city_ = nullptr;
StoredFamilies* InvariantsTest::stored_ = nullptr;
UndistortCache* InvariantsTest::tables_ = nullptr;
PhotoPreparer* InvariantsTest::preparer_ = nullptr;
ContentHash InvariantsTest::digest_;

TEST_F(InvariantsTest, AWholeDatabaseIsSoundAlsoDeeply) {
  const auto violations = FindViolations(
      *stored_->GetSnapshot(), CheckOptions{.count_max = 20, .deep = true, .preparer = preparer_});
  ASSERT_OK(violations);
  for (const std::string& violation : *violations) ADD_FAILURE() << violation;
  EXPECT_FALSE(IsNoticed(*stored_->GetSnapshot(), false));
}

TEST_F(InvariantsTest, EveryFieldThatIsNotFreeIsDetermined) {
  for (const FamilyTraits& traits : AllFamilies()) {
    for (const FieldDamage& damage : FieldDamagesOf(traits.family)) {
      for (const std::string& key : SomeKeys(traits.family, 3)) {
        const auto changed = damage.apply(key, *stored_->Get(traits.family, key));
        if (!changed) continue;
        stored_->Put(traits.family, key, *changed);
        Judge(traits.name + ("." + damage.field), PlaceOf(traits.family, key));
      }
    }
  }
  Report();
  for (const auto& [what, share] : shares_) {
    ExpectOnlyIn(kFree, what, share.silent);
    ExpectOnlyIn(kDeep, what, share.noticed_deeply);
  }
}

TEST_F(InvariantsTest, WhatIsMissingLeftOverOrExchangedIsNoticed) {
  ChangeEach("removed", 6, [&](Family family, const std::string& key) {
    if (family == Family::kPoints && HoldsNoPoint(key)) return false;
    stored_->Delete(family, key);
    return true;
  });
  ChangeEach("left over", 2, [&](Family family, const std::string& key) {
    std::string other = key;
    other.back() = static_cast<char>(other.back() ^ 64);
    if (stored_->Get(family, other)) return false;
    stored_->Put(family, other, *stored_->Get(family, key));
    return true;
  });
  ChangeEach("exchanged", 3, [&](Family family, const std::string& key) {
    const std::string other = stored_->Keys(family).front();
    const std::string value = *stored_->Get(family, key), first = *stored_->Get(family, other);
    if (value == first) return false;
    stored_->Put(family, key, first);
    stored_->Put(family, other, value);
    return true;
  });
  Report();
  for (const auto& [what, share] : shares_) {
    // A hypothesis that is missing is proposed anew, and a border found again.
    ExpectOnlyIn({"meta: removed"}, what, share.silent);
    ExpectOnlyIn({}, what, share.noticed_deeply);
  }
  EXPECT_EQ(shares_["meta: removed"].silent.size(), 2u);
}

TEST_F(InvariantsTest, BytesThatAreCutAddedOrFlippedAreNoticed) {
  looks_deeply_ = false;
  const auto resize = [&](int by) {
    return [&, by](Family family, const std::string& key) {
      std::string value = *stored_->Get(family, key);
      if (static_cast<int>(value.size()) + by < 0) return false;
      value.resize(value.size() + static_cast<size_t>(by));
      stored_->Put(family, key, value);
      return true;
    };
  };
  for (const int by : {-8, -4, 4, 8}) ChangeEach("of another length", 1, resize(by));
  for (const auto& [what, share] : shares_) ExpectOnlyIn({}, what, share.silent);
  SeededRandom random(1);
  const auto flip = [&](Family family, const std::string& key) {
    std::string value = *stored_->Get(family, key);
    if (value.empty()) return false;
    char& byte = value[random.Below(static_cast<uint32_t>(value.size()))];
    byte = static_cast<char>(byte ^ (1 << random.Below(8)));
    stored_->Put(family, key, value);
    return true;
  };
  for (int round = 0; round < 3; ++round) ChangeEach("one bit flipped", 3, flip);
  Report();
  for (const Family family : kDeterminedToTheByte)
    ExpectOnlyIn({}, FamilyName(family),
                 shares_[FamilyName(family) + std::string(": one bit flipped")].silent);
}

TEST_F(InvariantsTest, OneDamagedValueHidesNoOther) {
  const std::vector<std::string> images = stored_->Keys(Family::kImages);
  const std::string pair = stored_->Keys(Family::kPairs).back();
  const std::string words = stored_->Keys(Family::kWords).front();
  stored_->Put(Family::kImages, images.front(), "garbage");
  stored_->Put(Family::kPairs, pair, "garbage");
  stored_->Put(Family::kWords, words, "garbage");
  const auto violations = FindViolations(*stored_->GetSnapshot(), 1000);
  stored_->PutBack();
  ASSERT_OK(violations);
  for (const std::string& place : {PlaceOf(Family::kImages, images.front()),
                                   PlaceOf(Family::kPairs, pair), PlaceOf(Family::kWords, words)}) {
    EXPECT_EQ(std::count_if(violations->begin(), violations->end(),
                            [&](const std::string& v) { return v.starts_with(place); }),
              1)
        << place;
  }
}

TEST_F(InvariantsTest, WhatAMarkNamesIsHalfWrittenAndNoViolation) {
  const std::string photo = stored_->Keys(Family::kPhotos).front();
  const ContentHash hash = SampleHash(77);
  const std::string points = stored_->Keys(Family::kPoints).front();
  stored_->Put(Family::kPhotos, HashKey(hash), *stored_->Get(Family::kPhotos, photo));
  stored_->Put(Family::kWords, WordsKey(9, ImageId(1)), "");
  stored_->Put(Family::kPoints, PointBlockKey(ReconstructionId(1), 9, ImageId(1)),
               *stored_->Get(Family::kPoints, points));
  const auto left = FindViolations(*stored_->GetSnapshot(), 1000);
  ASSERT_OK(left);
  EXPECT_EQ(left->size(), 3u);
  stored_->Put(Family::kQueue, PhotoMarkKey(hash), "");
  stored_->Put(Family::kQueue, VocabularyMarkKey(9), "");
  stored_->Put(Family::kQueue, PointBlocksMarkKey(ReconstructionId(1), 9), "");
  const auto ahead = FindViolations(*stored_->GetSnapshot(), 1000);
  stored_->PutBack();
  ASSERT_OK(ahead);
  for (const std::string& violation : *ahead) ADD_FAILURE() << violation;
}

// Their matches have no parallax, so nothing says on which side of the cameras their points lie.
TEST(Invariants, CopiesOfAPictureAreSound) {
  City city;
  std::vector<PhotoSubmission> photos;
  for (const Stand& stand : Walk(6, 0.9, 4)) {
    const TakenPhoto& photo = TakePhoto(stand);
    photos.push_back(city.Submit(stand));
    std::vector<uint8_t> copy = photo.jpeg;
    copy.push_back(0);  // another file of the same picture
    photos.push_back(city.Submit("copy of " + photo.name, std::move(copy)));
  }
  city.Add(photos);
  const auto violations = FindViolations(city.Ask().snapshot(), 20);
  ASSERT_OK(violations);
  EXPECT_EQ(*violations, std::vector<std::string>());
}

}  // namespace
}  // namespace veduta
