// SPDX-License-Identifier: Apache-2.0
// Goal: the mark of what was acknowledged comes back as it was written, and no damage of its file
//   makes it claim more.
// Method: files written by it and changed byte by byte; a disk whose writes in place fail.
#include "storage/acknowledged.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "samples.h"

namespace veduta {
namespace {

std::optional<AcknowledgedMark> Read(const std::string& folder) {
  const auto mark = ReadAcknowledged(*rocksdb::FileSystem::Default(), folder);
  EXPECT_OK(mark);
  return mark.ok() ? *mark : std::nullopt;
}

TEST(Acknowledged, NewestMarkIsRead) {
  const TemporaryFolder folder;
  EXPECT_EQ(Read(folder.path()), std::nullopt);
  auto file =
      AcknowledgedFile::Open(rocksdb::FileSystem::Default(), folder.path(), {7, 0, 3, {2, 90}});
  ASSERT_OK(file);
  EXPECT_EQ(Read(folder.path()), (AcknowledgedMark{7, 0, 3, {2, 90}}));
  for (uint64_t i = 8; i < 13; ++i) {
    (*file)->Advance(i, 4);
    EXPECT_EQ(Read(folder.path()), (AcknowledgedMark{i, 4, 3, {2, 90}}));
  }
  (*file)->Advance(5, 9);
  EXPECT_EQ(Read(folder.path()), (AcknowledgedMark{12, 4, 3, {2, 90}})) << "it never goes back";
  (*file)->Finish(0, {2, 95});
  EXPECT_EQ(Read(folder.path()), (AcknowledgedMark{12, 4, 3, {2, 95}}));
  (*file)->Finish(20, {2, 95});
  EXPECT_EQ(Read(folder.path()), (AcknowledgedMark{20, 4, 3, {2, 95}}));
  file = AcknowledgedFile::Open(rocksdb::FileSystem::Default(), folder.path(), {21, 0, 9, {4, 80}});
  ASSERT_OK(file);
  EXPECT_EQ(Read(folder.path()), (AcknowledgedMark{21, 0, 9, {4, 80}}));
}

TEST(Acknowledged, DamageLeavesTheMarkBeforeOrNone) {
  const TemporaryFolder folder;
  const std::string path = folder / kAcknowledgedFile;
  const auto file =
      AcknowledgedFile::Open(rocksdb::FileSystem::Default(), folder.path(), {7, 5, 3, {2, 90}});
  ASSERT_OK(file);
  (*file)->Advance(8, 5);
  std::string whole;
  ASSERT_TRUE(rocksdb::ReadFileToString(rocksdb::FileSystem::Default().get(), path, &whole).ok());
  for (size_t byte = 0; byte < whole.size(); byte += byte % 4096 == 60 ? 4096 - 60 : 1) {
    std::string changed = whole;
    changed[byte] ^= 0x10;
    std::ofstream(path, std::ios::binary) << changed;
    const auto mark = Read(folder.path());
    ASSERT_TRUE(mark.has_value());
    EXPECT_TRUE(mark->sequence == 8 || mark->sequence == 7) << "byte " << byte;
  }
  for (const size_t size : {0, 10, 4096, 4100}) {
    std::ofstream(path, std::ios::binary) << whole.substr(0, size);
    const auto mark = Read(folder.path());
    EXPECT_TRUE(!mark || mark->sequence >= 7);
  }
  std::ofstream(path, std::ios::binary) << "";
  EXPECT_EQ(Read(folder.path()), std::nullopt);
  ASSERT_OK(
      AcknowledgedFile::Open(rocksdb::FileSystem::Default(), folder.path(), {9, 5, 3, {2, 90}}));
  EXPECT_EQ(Read(folder.path()), (AcknowledgedMark{9, 5, 3, {2, 90}})) << "made anew";
}

// Its writes in place fail once `fails` is set.
class NoWritesInPlace final : public rocksdb::FileSystemWrapper {
 public:
  NoWritesInPlace() : FileSystemWrapper(rocksdb::FileSystem::Default()) {}
  const char* Name() const override { return "NoWritesInPlace"; }
  rocksdb::IOStatus NewRandomRWFile(const std::string& name, const rocksdb::FileOptions& options,
                                    std::unique_ptr<rocksdb::FSRandomRWFile>* result,
                                    rocksdb::IODebugContext* debug) override {
    std::unique_ptr<rocksdb::FSRandomRWFile> file;
    const rocksdb::IOStatus opened = target()->NewRandomRWFile(name, options, &file, debug);
    if (opened.ok()) *result = std::make_unique<File>(std::move(file), fails);
    return opened;
  }
  bool fails = false;

 private:
  class File final : public rocksdb::FSRandomRWFileOwnerWrapper {
   public:
    File(std::unique_ptr<rocksdb::FSRandomRWFile> file, const bool& fails)
        : FSRandomRWFileOwnerWrapper(std::move(file)), fails_(fails) {}
    rocksdb::IOStatus Write(uint64_t offset, const rocksdb::Slice& data,
                            const rocksdb::IOOptions& options,
                            rocksdb::IODebugContext* debug) override {
      if (fails_) return rocksdb::IOStatus::IOError("injected fault");
      return FSRandomRWFileOwnerWrapper::Write(offset, data, options, debug);
    }

   private:
    const bool& fails_;
  };
};

TEST(Acknowledged, CommitSucceedsWhereTheMarkCannotBeWritten) {
  const TemporaryFolder folder;
  const auto disk = std::make_shared<NoWritesInPlace>();
  auto database = MustCreate(folder / "db", {.file_system = disk});
  disk->fails = true;
  const auto before = Read(folder / "db");
  for (uint32_t id = 1; id <= 3; ++id) {
    const auto transaction = database->BeginTransaction();
    transaction->PutCamera({CameraId(id), std::to_string(id), {1, 2, 3, 4, 5, 6, 7, 8, 9, 10}, ""});
    ASSERT_OK(transaction->Commit());
  }
  database.reset();
  EXPECT_EQ(Read(folder / "db"), before);
  disk->fails = false;
  database = MustOpen(folder / "db", {});
  ASSERT_NE(database, nullptr);
  EXPECT_EQ(database->GetSnapshot()->ListCameras()->size(), 3u);
}

}  // namespace
}  // namespace veduta
