// SPDX-License-Identifier: Apache-2.0
// Goal: files, folders and lists become the photos that they mean, under the names that they are to
//   have, in the right order.
// Method: a folder of empty files, links and a pipe in a temporary place.
#include "cli/photos/photo_list.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace veduta {
namespace {

namespace fs = std::filesystem;

class PhotoList : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / ("veduta_list_" + std::to_string(getpid()));
    for (const char* file : {"b.jpg", "a.jpg", "sub/c.jpg", "sub/deep/d.jpg", ".hidden.jpg",
                             ".git/e.jpg", "sub/.f.jpg", "line\nbreak.jpg"}) {
      fs::create_directories((folder_ / file).parent_path());
      std::ofstream(folder_ / file) << file;
    }
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string At(const std::string& name) const { return (folder_ / name).string(); }
  std::string List(const std::string& text) const {
    std::ofstream(folder_ / "list") << text;
    return At("list");
  }

 private:
  fs::path folder_;
};

std::vector<std::string> Names(const Result<std::vector<ListedPhoto>>& photos) {
  std::vector<std::string> names;
  EXPECT_TRUE(photos.ok()) << photos.status().message();
  if (!photos.ok()) return names;
  for (const ListedPhoto& photo : *photos) names.push_back(photo.name);
  return names;
}

using Strings = std::vector<std::string>;

Result<std::vector<ListedPhoto>> ListQuietly(const Strings& paths) {
  Strings passed_over;
  auto photos = ListPhotos(paths, &passed_over);
  EXPECT_EQ(passed_over, Strings{});
  return photos;
}

TEST_F(PhotoList, AFolderStandsForAllBelowIt) {
  const auto photos = ListQuietly({At("")});
  EXPECT_EQ(Names(photos),
            (Strings{"a.jpg", "b.jpg", "line\nbreak.jpg", "sub/c.jpg", "sub/deep/d.jpg"}));
  EXPECT_EQ(fs::path(photos->back().path), fs::path(At("sub/deep/d.jpg")));
  EXPECT_EQ(photos->back().camera, "");
  EXPECT_EQ(Names(ListQuietly({At("sub")})), (Strings{"c.jpg", "deep/d.jpg"}));
}

TEST_F(PhotoList, FilesKeepTheirOrder) {
  EXPECT_EQ(Names(ListQuietly({At("b.jpg"), At("sub/c.jpg"), At("a.jpg"), At("sub/.f.jpg")})),
            (Strings{"b.jpg", "c.jpg", "a.jpg", ".f.jpg"}));
  EXPECT_EQ(Names(ListQuietly({})), Strings{});
}

TEST_F(PhotoList, WhatIsNoFileIsPassedOverByName) {
  fs::create_symlink(At("missing"), At("sub/broken.jpg"));
  fs::create_symlink(At("sub/circle.jpg"), At("sub/circle.jpg"));
  fs::create_symlink(At("sub/there"), At("sub/back"));
  fs::create_symlink(At("sub/back"), At("sub/there"));
  fs::create_symlink(At(""), At("sub/up"));
  fs::create_symlink(At("a.jpg"), At("sub/link.jpg"));
  fs::create_symlink(At("sub/.circle.jpg"), At("sub/.circle.jpg"));  // hidden: not even named
  ASSERT_EQ(mkfifo(At("sub/pipe.jpg").c_str(), 0600), 0);
  Strings passed_over;
  EXPECT_EQ(Names(ListPhotos({At("sub")}, &passed_over)),
            (Strings{"c.jpg", "deep/d.jpg", "link.jpg"}));
  ASSERT_EQ(passed_over.size(), 6u);
  const std::pair<const char*, const char*> expected[] = {
      {"sub/back", "symbolic links"},  {"sub/broken.jpg", "a link to nothing"},
      {"sub/circle.jpg", "symbolic"},  {"sub/pipe.jpg", "no file"},
      {"sub/there", "symbolic links"}, {"sub/up", "a link to a folder"}};
  for (size_t i = 0; i < passed_over.size(); ++i) {
    EXPECT_NE(passed_over[i].find(expected[i].first), std::string::npos) << passed_over[i];
    EXPECT_NE(passed_over[i].find(expected[i].second), std::string::npos) << passed_over[i];
  }
}

TEST_F(PhotoList, WhatIsMissingIsNamed) {
  const auto photos = ListQuietly({At("a.jpg"), At("nowhere")});
  ASSERT_FALSE(photos.ok());
  EXPECT_EQ(photos.status().code(), StatusCode::kNotFound);
  EXPECT_NE(photos.status().message().find("nowhere"), std::string::npos);
}

TEST_F(PhotoList, AListInAFolderNamesByItsPaths) {
  const auto photos = ReadPhotoList(
      List("\xEF\xBB\xBF# in this order\nb.jpg\r\n\nsub/../a.jpg\tlens\n./sub/c.jpg\nmissing.jpg"),
      At(""));
  EXPECT_EQ(Names(photos), (Strings{"b.jpg", "a.jpg", "sub/c.jpg", "missing.jpg"}));
  EXPECT_EQ((*photos)[1].camera, "lens");
  EXPECT_EQ((*photos)[0].camera, "");
  EXPECT_EQ(fs::path((*photos)[0].path), fs::path(At("b.jpg")));
}

TEST_F(PhotoList, AListOfItsOwnNamesByTheCommonFolder) {
  EXPECT_EQ(Names(ReadPhotoList(List(At("sub/c.jpg") + "\n" + At("sub/deep/d.jpg") + "\n"), "")),
            (Strings{"c.jpg", "deep/d.jpg"}));
  EXPECT_EQ(Names(ReadPhotoList(List(At("sub/c.jpg") + "\n" + At("a.jpg") + "\n"), "")),
            (Strings{"sub/c.jpg", "a.jpg"}));
  EXPECT_EQ(Names(ReadPhotoList(List("# nothing\n"), "")), Strings{});
}

TEST_F(PhotoList, ALineWithoutAFileIsNamed) {
  for (const std::string& text : {std::string("a.jpg\n\tlens\n"), std::string("a\nb\0c\n", 6)}) {
    for (const char* folder : {"", "photos"}) {
      const Status status = ParsePhotoList(text, folder).status();
      EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
      EXPECT_EQ(status.message(), "line 2 names no file");
    }
  }
}

TEST_F(PhotoList, AListThatIsAPipeIsRefused) {
  ASSERT_EQ(mkfifo(At("pipe").c_str(), 0600), 0);
  const Status status = ReadPhotoList(At("pipe"), "").status();
  EXPECT_NE(status.message().find("is a pipe"), std::string::npos) << status.message();
}

TEST_F(PhotoList, AListThatCannotBeReadIsNamed) {
  for (const std::string& path : {At("no list"), At("sub")}) {
    const auto photos = ReadPhotoList(path, "");
    ASSERT_FALSE(photos.ok());
    EXPECT_NE(photos.status().message().find(path), std::string::npos);
  }
}

}  // namespace
}  // namespace veduta
