// SPDX-License-Identifier: Apache-2.0
// Goal: the table finds exactly what was set and not erased since, whatever the ids.
// Method: seeded random sets and erasures over ids near and far apart, beside a std::map.
#include "engine/mapping/image_table.h"

#include <gtest/gtest.h>

#include <map>

#include "storage/base/content_hash.h"

namespace veduta {
namespace {

TEST(ImageTable, FindsWhatAMapFinds) {
  SeededRandom random(1);
  std::vector<int> things(20);
  ImageTable<int> table;
  std::map<ImageId, int*> model;
  const auto draw = [&] {
    return ImageId(static_cast<uint32_t>(random.Below(2) == 0 ? random.Below(3000)
                                                              : 5'000'000 + random.Below(3000)));
  };
  for (int step = 0; step < 20'000; ++step) {
    const ImageId id = draw();
    if (random.Below(3) == 0) {
      table.Erase(id);
      model.erase(id);
    } else {
      int* const thing = &things[random.Below(things.size())];
      table.Set(id, thing);
      model[id] = thing;
    }
    const ImageId asked = draw();
    const auto known = model.find(asked);
    ASSERT_EQ(table.Find(asked), known == model.end() ? nullptr : known->second);
  }
  const ImageTable<int> moved = std::move(table);
  for (const auto& [id, thing] : model) EXPECT_EQ(moved.Find(id), thing);
}

TEST(ImageTable, AnIdNobodyHasIsNotFound) {
  int thing = 0;
  ImageTable<int> table;
  EXPECT_EQ(table.Find(ImageId(1)), nullptr);
  table.Set(ImageId(1), &thing);
  EXPECT_EQ(table.Find(ImageId(0)), nullptr);
  EXPECT_EQ(table.Find(ImageId(0xffffffff)), nullptr);
  table.Clear();
  EXPECT_EQ(table.Find(ImageId(1)), nullptr);
}

}  // namespace
}  // namespace veduta
