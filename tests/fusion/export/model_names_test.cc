// SPDX-License-Identifier: Apache-2.0
// Goal: no two images of a model have one name, and a name that is alone stays as it is.
// Method: records by hand, with names and contributors that run into each other.
#include "fusion/export/model_names.h"

#include <gtest/gtest.h>

#include <vector>

namespace veduta {
namespace {

TEST(ModelNames, AreUnique) {
  std::vector<ImageRecord> images(7);
  const std::pair<const char*, const char*> names[] = {
      {"anna", "1.jpg"}, {"bert", "1.jpg"}, {"carl", "bert/1.jpg"}, {"anna", "walk/2.jpg"},
      {"anna", "3.jpg"}, {"bert", "3.jpg"}, {"dora", "#2/1.jpg"}};
  std::vector<const ImageRecord*> all;
  for (uint32_t i = 0; i < images.size(); ++i) {
    images[i].id = ImageId(i + 1);
    images[i].contributor = names[i].first;
    images[i].name = names[i].second;
    all.push_back(&images[i]);
  }
  EXPECT_EQ(ModelNames(all), (std::map<ImageId, std::string>{{ImageId(1), "anna/1.jpg"},
                                                             {ImageId(2), "##2/1.jpg"},
                                                             {ImageId(3), "bert/1.jpg"},
                                                             {ImageId(4), "walk/2.jpg"},
                                                             {ImageId(5), "anna/3.jpg"},
                                                             {ImageId(6), "bert/3.jpg"},
                                                             {ImageId(7), "#2/1.jpg"}}));
  EXPECT_TRUE(ModelNames(Scene()).empty());
}

}  // namespace
}  // namespace veduta
