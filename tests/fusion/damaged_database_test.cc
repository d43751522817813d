// SPDX-License-Identifier: Apache-2.0
// Goal: whatever lies in a database, no part of the engine aborts: what it cannot use is an error
//   that is about the database. What the dense pass stored and lost is noticed.
// Method: a densified street with a vocabulary; for each damage a copy of it, of which one value is
//   changed in one field, in one bit, or removed; then everything that the door offers is asked of
//   it, in this process, so an abort ends the test behind the line that names the damage. A sample
//   in CI; VEDUTA_DAMAGES=n tries n of them.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <set>

#include "fusion/pass/dense_invariants.h"
#include "tests/engine/query/field_damage.h"
#include "tests/engine/street_fixture.h"
#include "tests/storage/stored_families.h"

namespace veduta {
namespace {

constexpr uint32_t kDamagesInCi = 8;  // a second each where the machine is busy; chosen by hand

class DamagedDatabaseTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    CityOptions options = City::Options(2);
    options.ingest.retrieval.compare_all_max = 4;
    options.prepare.features.feature_count_max = 1200;
    city_ = new City(options);
    city_->Add(Walk(20, 0.8, 6));
    ASSERT_OK(city_->engine().Densify(Dense(), {}));
    const auto violations = city_->engine().Ask().Verify({.count_max = 10, .deep = true});
    ASSERT_OK(violations);
    for (const std::string& violation : *violations) ADD_FAILURE() << violation;
    city_->Close();
  }
  static void TearDownTestSuite() { delete city_; }

  static DensifyRequest Dense() {
    DensifyRequest request;
    request.device = "cpp";
    request.options.depth_side_px = 64;
    return request;
  }

  // Fails where the error is not about what is stored.
  static void Tell(const Status& status, const char* what) {
    const std::set<StatusCode> known = {StatusCode::kOk,
                                        StatusCode::kCorruption,
                                        StatusCode::kNotFound,
                                        StatusCode::kInvalidArgument,
                                        StatusCode::kAlreadyExists,
                                        StatusCode::kIoError};
    EXPECT_TRUE(known.contains(status.code())) << what << ": " << status.message();
    if (!status.ok()) std::printf("  %s: %s\n", what, status.message().c_str());
  }

  static void TellSurface(const Questions& ask) {
    const auto tileset = ask.Tileset(ReconstructionId(1));
    Tell(tileset.status(), "tileset");
    if (!tileset.ok()) return;
    const std::string before = "tiles/", after = ".glb";
    for (size_t at = 0; (at = tileset->json.find(before, at)) != std::string::npos;) {
      at += before.size();
      const std::string name = tileset->json.substr(at, tileset->json.find(after, at) - at);
      Tell(ask.SurfaceTile(ReconstructionId(1), name).status(), "surface tile");
    }
  }

  // All that reads a whole database, and what writes to it.
  static void Use(const std::string& path, const std::string& scratch) {
    EngineOptions options;
    options.thread_count = 2;
    options.sync = false;
    const auto engine = Engine::Open(path, options);
    Tell(engine.status(), "open");
    if (!engine.ok()) return;
    {
      const Questions ask = (*engine)->Ask();
      Tell(ask.Status().status(), "status");
      Tell(ask.Image("#2").status(), "show");
      Tell(ask.Neighbors("#2").status(), "neighbors");
      Tell(ask.Digest().status(), "digest");
      Tell(ask.Verify({.count_max = 1000, .deep = false}).status(), "verify");
      for (const char* format : {"colmap", "gltf"})
        Tell(ask.Export({scratch + "/" + format, format, 0}).status(), format);
      RenderRequest render;
      render.path = scratch + "/picture.png";
      render.side_px = 32;
      Tell(ask.Render(render).status(), "render");
      TellSurface(ask);
    }
    const TakenPhoto& photo = TakePhoto({24.2, 90});
    const PhotoSubmission submissions[] = {
        {{photo.name, photo.name, photo.jpeg}, "street", "carl"}};
    Tell((*engine)->AddPhotos(
             submissions, [](const AddOutcome&) {}, {},
             [](const FollowUp& step) { Tell(step.status, "follow up"); }),
         "add");
    Tell((*engine)->Densify(Dense(), {}).status(), "densify");
  }

  // Changes one value of the database at `path`; what it did, or nothing.
  static std::string Damage(const std::string& path, uint32_t seed) {
    SeededRandom random(seed);
    StoredFamilies stored(path);
    const auto families = AllFamilies();
    const Family family = families[random.Below(static_cast<uint32_t>(families.size()))].family;
    const std::vector<std::string> keys = stored.Keys(family);
    if (keys.empty()) return "";
    const std::string key = keys[random.Below(static_cast<uint32_t>(keys.size()))];
    if (key == kFormatKey) return "";
    std::string value = *stored.Get(family, key);
    const std::string where = PlaceOf(family, key);
    const std::vector<FieldDamage> fields = FieldDamagesOf(family);
    if (!fields.empty() && random.Below(3) > 0) {
      const FieldDamage& field = fields[random.Below(static_cast<uint32_t>(fields.size()))];
      const auto changed = field.apply(key, value);
      if (!changed) return "";
      stored.Put(family, key, *changed);
      return where + ": " + field.field;
    }
    if (value.empty() || random.Below(4) == 0) {
      stored.Delete(family, key);
      return where + ": removed";
    }
    char& byte = value[random.Below(static_cast<uint32_t>(value.size()))];
    byte = static_cast<char>(byte ^ (1 << random.Below(8)));
    stored.Put(family, key, value);
    return where + ": one bit flipped";
  }

  static City* city_;
};
City* DamagedDatabaseTest::city_ = nullptr;

TEST_F(DamagedDatabaseTest, NothingThatIsStoredAborts) {
  const char* const wanted = std::getenv("VEDUTA_DAMAGES");
  const uint32_t count =
      wanted ? static_cast<uint32_t>(std::strtoul(wanted, nullptr, 10)) : kDamagesInCi;
  uint32_t done = 0;
  for (uint32_t seed = 1; done < count; ++seed) {
    const TemporaryFolder folder;
    std::filesystem::copy(city_->path(), folder / "db", std::filesystem::copy_options::recursive);
    const std::string what = Damage(folder / "db", seed);
    if (what.empty()) continue;
    ++done;
    std::printf("%u: %s\n", seed, what.c_str());
    std::fflush(stdout);
    SCOPED_TRACE(what);
    Use(folder / "db", folder.path());
  }
}

TEST_F(DamagedDatabaseTest, WhatTheDensePassLostOrLeftIsNoticed) {
  StoredFamilies stored(city_->path());
  const auto expect_noticed = [&](Family family, const std::string& key, const char* what) {
    const auto violations = FindDenseViolations(*stored.GetSnapshot(), 1);
    ASSERT_OK(violations);
    EXPECT_FALSE(violations->empty()) << PlaceOf(family, key) << ": " << what;
    stored.PutBack();
  };
  for (const Family family : {Family::kDense, Family::kDepth, Family::kVolume, Family::kSurface}) {
    std::set<char> kinds;  // one key for each kind of entry
    for (const std::string& key : stored.Keys(family)) {
      if (!kinds.insert(key[0]).second) continue;
      const std::string value = *stored.Get(family, key);
      stored.Delete(family, key);
      expect_noticed(family, key, "removed");
      std::string other = key;
      other[4] = static_cast<char>(other[4] ^ 64);
      stored.Put(family, other, value);
      expect_noticed(family, other, "left over");
      stored.Put(family, key, value.substr(0, value.size() - 8));
      expect_noticed(family, key, "cut");
      stored.Put(family, key, value + std::string(8, '\0'));
      expect_noticed(family, key, "lengthened");
    }
    EXPECT_FALSE(kinds.empty());
  }
}

}  // namespace
}  // namespace veduta
