// SPDX-License-Identifier: Apache-2.0
// Goal: pictures of a HEIF that are made of each other are noticed, and no others.
// Method: boxes of references written by the test, also into a sound file, which is then refused.
#include "engine/camera/heif_references.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "tests/engine/camera/heif_grid_writer.h"

namespace veduta {
namespace {

using testing::BoxOf;
using testing::Number;

struct Reference {
  std::string type;
  int from;
  std::vector<int> to;
};

std::string MetaOf(const std::vector<Reference>& references, int id_size = 2) {
  std::string content = Number(id_size == 2 ? 0 : 1u << 24, 4);
  for (const Reference& reference : references) {
    std::string ids = Number(reference.from, id_size) + Number(reference.to.size(), 2);
    for (const int to : reference.to) ids += Number(to, id_size);
    content += BoxOf(reference.type, ids);
  }
  return BoxOf("meta", Number(0, 4) + BoxOf("hdlr", "pict") + BoxOf("iref", content));
}

bool IsEndless(const std::string& text) {
  const std::vector<uint8_t> bytes(text.begin(), text.end());  // so that a sanitizer sees its end
  return HasEndlessReferences(bytes);
}

TEST(HeifReferences, WhatPhonesWriteEnds) {
  for (const int id_size : {2, 4}) {
    EXPECT_FALSE(IsEndless(MetaOf({}, id_size)));
    EXPECT_FALSE(IsEndless(BoxOf("ftyp", "heic") + MetaOf({{"dimg", 49, {1, 2, 3, 4}},
                                                           {"thmb", 50, {49}},
                                                           {"cdsc", 51, {49}},
                                                           {"auxl", 52, {49}},
                                                           {"dimg", 52, {5, 6}}},
                                                          id_size)));
  }
  EXPECT_FALSE(HasEndlessReferences(testing::HeifFileOf(testing::TestPicture(64, 64))));
}

TEST(HeifReferences, CirclesAndLongWaysDoNot) {
  for (const int id_size : {2, 4}) {
    EXPECT_TRUE(IsEndless(MetaOf({{"dimg", 1, {1}}}, id_size)));
    EXPECT_TRUE(IsEndless(MetaOf({{"dimg", 1, {2}}, {"dimg", 2, {3}}, {"dimg", 3, {1}}}, id_size)));
    EXPECT_TRUE(IsEndless(MetaOf({{"auxl", 1, {2}}, {"auxl", 2, {1}}}, id_size)));
    EXPECT_TRUE(IsEndless(MetaOf({{"dimg", 1, {2}}, {"auxl", 1, {2}}}, id_size)));
  }
  std::vector<Reference> way;
  for (int i = 1; i <= 8; ++i) way.push_back({"dimg", i, {i + 1}});
  EXPECT_FALSE(IsEndless(MetaOf(way)));
  way.push_back({"dimg", 9, {10}});
  EXPECT_TRUE(IsEndless(MetaOf(way)));
}

TEST(HeifReferences, SizesThatContradictAreRefusedAndCutsAreHarmless) {
  std::string meta = MetaOf({{"dimg", 1, {2, 3}}});
  for (size_t size = 0; size < meta.size(); ++size) IsEndless(meta.substr(0, size));
  meta[meta.size() - 5] = 3;  // the count
  EXPECT_TRUE(IsEndless(meta));
}

}  // namespace
}  // namespace veduta
