// SPDX-License-Identifier: Apache-2.0
// Goal: a city that is made anew from its photos is sound and has all of them, under their names.
// Method: the photos of a whole street database are added to a new one.
#include "engine/repair/rebuilding.h"

#include "tests/engine/repair/damaged_city.h"

namespace veduta {
namespace {

TEST(Rebuilding, AddsEveryPhotoUnderItsName) {
  const DamagedCity city;
  const auto source = Salvage::Open(city.path(), city.folder() / "links", {});
  ASSERT_OK(source);
  UndistortCache tables(64 << 20);
  const PhotoPreparer preparer(nullptr, &tables, PrepareOptions());
  Healing examined(**source, preparer, nullptr, {});
  ASSERT_OK(HealAll(&examined));
  EngineOptions options;
  options.create = true;
  options.thread_count = 2;
  const auto engine = Engine::Open(city.folder() / "new", options);
  ASSERT_OK(engine);
  ASSERT_OK(RebuildFromPhotos(examined, engine->get()));
  const Questions questions = (*engine)->Ask();
  const auto violations = questions.Verify({.count_max = 20});
  ASSERT_OK(violations);
  EXPECT_EQ(*violations, std::vector<std::string>());
  for (const Stand& stand : Walk(4, 1.2, kStreetPhotos)) {
    const auto image = questions.Image(TakePhoto(stand).name);
    ASSERT_OK(image);
    EXPECT_EQ(image->contributor, "anna");
    EXPECT_NE(image->verdict, Verdict::kRejected);
  }
}

}  // namespace
}  // namespace veduta
