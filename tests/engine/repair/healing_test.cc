// SPDX-License-Identifier: Apache-2.0
// Goal: what a healing leaves out is damaged, not only unreadable at the moment; surfaces that are
//   not finished come along.
// Method: one street database is healed into a new one, record by record; once with a disk whose
//   reads fail.
#include "engine/repair/healing.h"

#include "tests/engine/repair/damaged_city.h"
#include "tests/storage/fault_file_system.h"

namespace veduta {
namespace {

TEST(Healing, TellsDamageFromFailuresOfTheMachine) {
  EXPECT_TRUE(IsDamage(Status::Corruption("block checksum mismatch")));
  EXPECT_TRUE(IsDamage(Status::NotFound("no such key")));
  EXPECT_TRUE(IsDamage(Status::IoError("IO error: No such file or directory: While open 7.blob")));
  EXPECT_FALSE(IsDamage(Status::IoError("IO error: Too many open files: While open 7.blob")));
  EXPECT_FALSE(IsDamage(Status::IoError("IO error: Input/output error: While pread 7.blob")));
}

TEST(Healing, EndsWhereTheDiskDoesNotAnswer) {
  const DamagedCity city;
  const auto disk = std::make_shared<FaultFileSystem>();
  DatabaseOptions options;
  options.file_system = disk;
  const auto source = Salvage::Open(city.path(), city.folder() / "links", options);
  ASSERT_OK(source);
  UndistortCache tables(64 << 20);
  const PhotoPreparer preparer(nullptr, &tables, PrepareOptions());
  Healing healing(**source, preparer, nullptr, {});
  disk->Fail(Only(Operation::kRead), 1, Fault::kIoError, FaultFileSystem::kForever);
  EXPECT_EQ(HealAll(&healing).code(), StatusCode::kIoError);
  EXPECT_EQ(healing.notes.lost, std::vector<std::string>());
}

TEST(Healing, TakesUnfinishedSurfacesAlong) {
  const DamagedCity city;
  const ReconstructionId own(1), staged = StagedSurfaceOf(own);
  {
    const auto database = Database::Open(city.path(), {});
    ASSERT_OK(database);
    const auto transaction = (*database)->BeginTransaction();
    for (const ReconstructionId surface : {own, staged}) {
      transaction->dense().PutSettings({surface, surface == own ? 0.2 : 0.4, 96, 2});
      TileRecord tile;
      tile.reconstruction = surface;
      tile.place = {1, 2, 3};
      transaction->dense().PutTile(tile);
    }
    ASSERT_OK(transaction->Commit());
  }
  const auto source = Salvage::Open(city.path(), city.folder() / "links", {});
  ASSERT_OK(source);
  DatabaseOptions create;
  create.create = true;
  const auto target = Database::Open(city.folder() / "new", create);
  ASSERT_OK(target);
  UndistortCache tables(64 << 20);
  const PhotoPreparer preparer(nullptr, &tables, PrepareOptions());
  Healing healing(**source, preparer, target->get(), {});
  ASSERT_OK(HealAll(&healing));
  ASSERT_TRUE(healing.IsLiving(own));
  const auto snapshot = (*target)->GetSnapshot();
  for (const ReconstructionId surface : {own, staged}) {
    const auto settings = snapshot->dense().FindSettings(surface);
    ASSERT_OK(settings);
    ASSERT_TRUE(settings->has_value()) << surface.value;
    EXPECT_EQ((*settings)->voxel_size, surface == own ? 0.2 : 0.4);
    const auto tile = snapshot->dense().FindTile(surface, {1, 2, 3});
    ASSERT_OK(tile);
    EXPECT_TRUE(tile->has_value()) << surface.value;
  }
}

}  // namespace
}  // namespace veduta
