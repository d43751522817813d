// SPDX-License-Identifier: Apache-2.0
// Goal: people find an image by what they know of it, and are told which images a text may mean
//   where it may mean several.
// Method: records of images alone, of several contributors who have given the same names.
#include "engine/query/find_image.h"

#include <gtest/gtest.h>

#include <cctype>

#include "tests/storage/samples.h"

namespace veduta {
namespace {

class FindImageTest : public testing::Test {
 protected:
  void Add(uint32_t id, const std::string& name, const std::string& contributor) {
    ImageRecord image = SampleImage(id);
    image.name = name;
    image.contributor = contributor;
    const auto transaction = database_->BeginTransaction();
    transaction->PutImage(image);
    ASSERT_OK(transaction->Commit());
  }
  // Its number; 0 where there is none.
  uint32_t Find(const std::string& text) const {
    const auto image = FindImage(*database_->GetSnapshot(), text);
    return image.ok() ? image->id.value : 0;
  }
  Status Failure(const std::string& text) const {
    return FindImage(*database_->GetSnapshot(), text).status();
  }

  const TemporaryFolder folder_;
  const std::unique_ptr<Database> database_ = MustCreate(folder_ / "db");
};

TEST_F(FindImageTest, ByNameNumberAndHash) {
  Add(1, "walk/1.jpg", "anna");
  Add(2, "walk/2.jpg", "anna");
  EXPECT_EQ(Find("walk/2.jpg"), 2u);
  EXPECT_EQ(Find("anna/walk/2.jpg"), 2u);
  EXPECT_EQ(Find("#2"), 2u);
  std::string hash = SampleImage(2).photo.Hex();
  for (const size_t digits : {kHashDigitsMin, kHashDigitsMin + 1, hash.size()})
    EXPECT_EQ(Find(hash.substr(0, digits)), 2u) << digits;
  for (char& c : hash) c = static_cast<char>(std::toupper(c));
  EXPECT_EQ(Find(hash), 2u);
}

TEST_F(FindImageTest, WhatIsNotThereIsNamed) {
  Add(1, "walk/1.jpg", "anna");
  const std::string hash = SampleImage(1).photo.Hex();
  for (const std::string& text :
       {std::string("nobody.jpg"), std::string("#"), std::string("#3x"), std::string("1"),
        std::string(), std::string("walk/"), std::string("bert/walk/1.jpg"), std::string("anna/"),
        hash.substr(0, kHashDigitsMin - 1), hash + "0", std::string("walk/1.jp")}) {
    EXPECT_EQ(Failure(text).code(), StatusCode::kNotFound) << text;
    EXPECT_EQ(Failure(text).message(), "there is no image '" + text + "' in the database");
  }
  EXPECT_EQ(Failure("#77").code(), StatusCode::kNotFound);
}

TEST_F(FindImageTest, ANameOfSeveralIsToldByItsContributor) {
  Add(1, "IMG_1.jpg", "anna");
  Add(2, "IMG_1.jpg", "bert");
  Add(3, "IMG_10.jpg", "anna");
  const Status several = Failure("IMG_1.jpg");
  EXPECT_EQ(several.code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(several.message(),
            "'IMG_1.jpg' may mean several photos; say which: #1 is 'anna/IMG_1.jpg', #2 is "
            "'bert/IMG_1.jpg'");
  EXPECT_EQ(Find("anna/IMG_1.jpg"), 1u);
  EXPECT_EQ(Find("bert/IMG_1.jpg"), 2u);
  EXPECT_EQ(Find("IMG_10.jpg"), 3u);
  for (uint32_t id = 4; id < 12; ++id) Add(id, "IMG_1.jpg", "guest " + std::to_string(id));
  EXPECT_TRUE(Failure("IMG_1.jpg").message().ends_with("'guest 4/IMG_1.jpg', and more"))
      << Failure("IMG_1.jpg").message();
}

TEST_F(FindImageTest, AFolderMayBeCalledAsAContributor) {
  Add(1, "anna/1.jpg", "bert");
  EXPECT_EQ(Find("anna/1.jpg"), 1u);
  Add(2, "1.jpg", "anna");
  EXPECT_EQ(Failure("anna/1.jpg").code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(Find("bert/anna/1.jpg"), 1u);
  EXPECT_EQ(Find("1.jpg"), 2u);
}

TEST_F(FindImageTest, AnythingMayBeAName) {
  const std::string hash = SampleImage(1).photo.Hex();
  Add(1, "a photo", "anna");
  Add(2, hash, "anna");
  Add(3, "#1", "anna");
  Add(4, std::string("zero\0byte", 9), std::string("\0\1\xff", 3));
  EXPECT_EQ(Find(hash), 1u) << "no name can stand in for a hash";
  EXPECT_EQ(Find("anna/" + hash), 2u);
  EXPECT_EQ(Find("#1"), 1u) << "nor for a number";
  EXPECT_EQ(Find("anna/#1"), 3u);
  Add(5, "#77", "anna");
  EXPECT_EQ(Find("#77"), 5u) << "no image has this number";
  Add(6, hash.substr(0, kHashDigitsMin), "anna");
  EXPECT_EQ(Find(hash.substr(0, kHashDigitsMin)), 6u) << "names come before a part of a hash";
  EXPECT_EQ(Find(std::string(100'000, '/')), 0u);
  EXPECT_EQ(Find(std::string("zero\0byte", 9)), 4u);
  EXPECT_EQ(Find("zero"), 0u);
}

}  // namespace
}  // namespace veduta
