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
#include "tests/engine/query/field_damage.h"
#include "tests/engine/street_fixture.h"
#include "tests/storage/stored_families.h"

namespace veduta {
namespace {

// Fields of the digest that nothing else determines; FORMAT.md lists them, and says why.
const std::set<std::string> kFree = {
    "cameras.source",
    "cameras.k1",
    "cameras.k2",
    "cameras.u0",
    "cameras.v0",
    "meta.pendingPropagation",
    "images.detail",
    "images.reason within its verdict",
    "images.photo",
    "images.widthPx",
    "images.heightPx",
    "images.sizeBytes",
    "images.featureCount",
    "images.camera",
    "features.keypoints: x of one",
    "features.keypoints: y of one",
    "features.keypoints: scale of one",
    "features.keypoints: angle of one",
    "features.keypoints: response of the last, to less",
    "features.keypoints: sign of one",
    "features.descriptors: one byte",
    "features.descriptors: all of one",
    "points.nextOrdinal",
    "points.colors",
    "reconstructions.mergedFromThisScale",
    "reconstructions.mergedFromThis: rotation",
    "reconstructions.mergedFromThis: translation",
};

// Every kind of record: two cameras and contributors, photos that are placed, merged, founded,
// postponed and rejected, and a vocabulary.
void Fill(City* city) {
  ASSERT_OK(city->engine().AddCamera("second", StreetCameraModel(), "the truth again"));
  std::vector<PhotoSubmission> photos;
  for (const Stand& stand : Walk(6, 1.1, 5)) photos.push_back(city->Submit(stand));
  for (const Stand& stand : Walk(19, 1.1, 5)) photos.push_back(city->Submit(stand));
  for (const Stand& stand : Walk(10.6, 1.1, 8)) photos.push_back(city->Submit(stand));
  photos.push_back(city->Submit(Stand{60, 90}));
  photos.push_back(city->Submit("blank.jpg", {1, 2, 3}));
  for (size_t i = 0; i < photos.size(); i += 3) photos[i].contributor = "bert";
  photos[1].camera = "second";
  const auto outcomes = city->Add(photos);
  std::set<Verdict> verdicts;
  for (const AddOutcome& outcome : outcomes) verdicts.insert(outcome.verdict);
  EXPECT_GE(verdicts.size(), 4u) << Told(outcomes);
}

struct Share {
  size_t tried = 0, noticed = 0, harmless = 0;
  std::vector<std::string> silent;
};

class InvariantsTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    CityOptions options = City::Options(2);
    options.ingest.retrieval.compare_all_max = 6;
    city_ = new City(options);
    Fill(city_);
    city_->Close();
    stored_ = new StoredFamilies(city_->path());
    const auto digest = DigestOf(*stored_->GetSnapshot());
    ASSERT_OK(digest);
    digest_ = *digest;
  }
  static void TearDownTestSuite() {
    delete stored_;
    delete city_;
  }

  // Whether the damage that is done now is noticed; puts it back.
  void Judge(const std::string& what, const std::string& where, bool deep = false) {
    Share& share = shares_[what];
    ++share.tried;
    const auto snapshot = stored_->GetSnapshot();
    const auto violations = FindViolations(*snapshot, CheckOptions{.count_max = 1, .deep = deep});
    EXPECT_TRUE(violations.ok()) << what << ": " << violations.status().message();
    if (violations.ok() && !violations->empty()) {
      ++share.noticed;
    } else {
      const auto digest = DigestOf(*snapshot);
      if (digest.ok() && *digest == digest_) {
        ++share.harmless;
      } else {
        share.silent.push_back(where);
      }
    }
    stored_->PutBack();
  }

  void Report() const {
    for (const auto& [what, share] : shares_) {
      std::printf("%-60s noticed %3zu, changes no digest %3zu, silent %3zu of %3zu\n", what.c_str(),
                  share.noticed, share.harmless, share.silent.size(), share.tried);
    }
  }
  void ExpectNoneSilent(const std::set<std::string>& free) const {
    for (const auto& [what, share] : shares_) {
      if (share.silent.empty() || free.contains(what)) continue;
      ADD_FAILURE() << what << " at " << share.silent.front() << " and " << share.silent.size() - 1
                    << " others changes the digest, and is not noticed";
    }
  }

  // The first, the last, and some between.
  static std::vector<std::string> SomeKeys(Family family, size_t count) {
    const std::vector<std::string> keys = stored_->Keys(family);
    std::set<std::string> some;
    for (size_t i = 0; i < count && !keys.empty(); ++i)
      some.insert(keys[i * (keys.size() - 1) / std::max<size_t>(1, count - 1)]);
    return {some.begin(), some.end()};
  }

  static City* city_;
  static StoredFamilies* stored_;
  static ContentHash digest_;
  std::map<std::string, Share> shares_;
};
City* InvariantsTest::city_ = nullptr;
StoredFamilies* InvariantsTest::stored_ = nullptr;
ContentHash InvariantsTest::digest_;

TEST_F(InvariantsTest, AWholeDatabaseIsSoundAlsoDeeply) {
  for (const bool deep : {false, true}) {
    const auto violations =
        FindViolations(*stored_->GetSnapshot(), CheckOptions{.count_max = 20, .deep = deep});
    ASSERT_OK(violations);
    for (const std::string& violation : *violations) ADD_FAILURE() << violation;
  }
}

TEST_F(InvariantsTest, EveryFieldThatIsNotFreeIsDetermined) {
  for (const FamilyTraits& traits : AllFamilies()) {
    for (const FieldDamage& damage : FieldDamagesOf(traits.family)) {
      for (const std::string& key : SomeKeys(traits.family, 4)) {
        const auto changed = damage.apply(key, *stored_->Get(traits.family, key));
        if (!changed) continue;
        stored_->Put(traits.family, key, *changed);
        Judge(traits.name + ("." + damage.field), PlaceOf(traits.family, key));
      }
    }
  }
  Report();
  ExpectNoneSilent(kFree);
}

}  // namespace
}  // namespace veduta
