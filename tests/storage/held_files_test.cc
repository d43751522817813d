// SPDX-License-Identifier: Apache-2.0
// Goal: whoever reads beside a writer sees one whole state to the end, whatever the writer deletes,
//   and opening never fails because of it.
// Method: a writer that commits, flushes, compacts and collects blob files without a pause; readers
//   that open the database again and again and read all of it slowly; and a writer that replaces
//   its log at each moment of an opening. A longer run with processes is
//   tools/readers_beside_writer.sh.
#include "storage/held_files.h"

#include <gtest/gtest.h>
#include <rocksdb/file_system.h>

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "log_damage.h"
#include "storage/opening_gate.h"

namespace veduta {
namespace {

constexpr size_t kPhotoBytes = 20'000;

// Adds images, and leaves blobs behind that nobody needs any more.
void Write(Database& database, const std::atomic<bool>& stop, std::atomic<uint32_t>& compactions) {
  for (uint32_t id = 2; !stop; ++id) {
    ASSERT_OK(AddImage(database, id, kPhotoBytes));
    ASSERT_OK(database.WriteVocabularyAhead(id, SampleBytes(id, 200'000)));
    const auto transaction = database.BeginTransaction();
    if (id > 2) transaction->DeleteVocabulary(id - 1);
    transaction->DeletePointBlocks(ReconstructionId(id), 1);
    ASSERT_OK(transaction->Commit());
    ASSERT_OK(database.WritePhotoAhead(SampleHash(1'000'000 + id), SampleBytes(id, 50'000), {}));
    ASSERT_OK(database.DropPhotoAhead(SampleHash(1'000'000 + id)));
    if (id % 4 == 0) {
      ASSERT_OK(database.Compact());
      ++compactions;
      // Each moves the files of all families: ten times a second is more than any writer needs.
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  }
}

// Reads everything, while the writer goes on for at least two compactions.
void ReadWhole(const Database& database, const std::atomic<uint32_t>& compactions,
               const std::atomic<bool>& stop) {
  const auto snapshot = database.GetSnapshot();
  const auto state = snapshot->GetState();
  ASSERT_OK(state);
  const uint32_t before = compactions;
  while (compactions < before + 2 && !stop) std::this_thread::yield();
  uint32_t count = 0;
  ASSERT_OK(snapshot->ScanImages([&](const ImageRecord& image) {
    ++count;
    const auto photo = snapshot->GetPhoto(image.photo);
    EXPECT_OK(photo);
    EXPECT_TRUE(!photo.ok() || photo->bytes().size() == kPhotoBytes);
    EXPECT_OK(snapshot->GetFeatures(image.photo));
    return !testing::Test::HasFailure();
  }));
  EXPECT_EQ(count + 1, state->next_image) << "one state, and all of it";
}

TEST(HeldFiles, ReadersBesideAWriterNeverFail) {
  const TemporaryFolder folder;
  const auto database = MustCreate(folder / "db");
  ASSERT_OK(AddImage(*database, 1, kPhotoBytes));
  std::atomic<bool> stop = false;
  std::atomic<uint32_t> compactions = 0, readings = 0;
  std::thread writer([&] { Write(*database, stop, compactions); });
  std::vector<std::thread> readers;
  for (int i = 0; i < 4; ++i) {
    readers.emplace_back([&] {
      while (!stop && !testing::Test::HasFailure()) {
        const auto reader = MustOpen(folder / "db", {.read_only = true});
        ASSERT_NE(reader, nullptr);
        ReadWhole(*reader, compactions, stop);
        ++readings;
      }
    });
  }
  while ((readings <= 4 || compactions <= 4) && !testing::Test::HasFailure())
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  stop = true;
  writer.join();
  for (std::thread& reader : readers) reader.join();
}

// Lets a writer replace its log when RocksDB is about to read the manifest or to list the folder:
// at the moment of this number, and at the next one.
class WriterInBetween final : public rocksdb::FileSystemWrapper {
 public:
  WriterInBetween(int moment, std::function<void()> write)
      : FileSystemWrapper(rocksdb::FileSystem::Default()),
        left_(moment),
        write_(std::move(write)) {}
  const char* Name() const override { return "WriterInBetween"; }
  rocksdb::IOStatus NewSequentialFile(const std::string& path, const rocksdb::FileOptions& options,
                                      std::unique_ptr<rocksdb::FSSequentialFile>* file,
                                      rocksdb::IODebugContext* debug) override {
    if (path.find("MANIFEST") != std::string::npos) Count();
    return target()->NewSequentialFile(path, options, file, debug);
  }
  rocksdb::IOStatus GetChildren(const std::string& folder, const rocksdb::IOOptions& options,
                                std::vector<std::string>* names,
                                rocksdb::IODebugContext* debug) override {
    Count();
    return target()->GetChildren(folder, options, names, debug);
  }
  bool has_written() const { return left_ <= 0; }

 private:
  void Count() {
    --left_;
    if (left_ == 0 || left_ == -1) write_();
  }

  int left_;
  const std::function<void()> write_;
};

TEST(HeldFiles, NoLogIsMissedThatComesAndGoesWhileAReaderOpens) {
  const TemporaryFolder folder;
  const auto writer = MustCreate(folder / "db");
  // A reader that never ends its opening: the writer goes on in spite of it, and of the others.
  const OpeningGate gate = OpeningGate::EnterToOpen(folder / "db");
  ASSERT_TRUE(gate.is_held());
  uint32_t id = 0;
  const auto write = [&] {
    ASSERT_OK(AddImage(*writer, ++id, 100));
    ASSERT_OK(writer->Compact());
    ASSERT_OK(AddImage(*writer, ++id, 100));
  };
  write();
  bool reached = true;
  for (int moment = 1; reached; ++moment) {
    SCOPED_TRACE("moment " + std::to_string(moment));
    const auto file_system = std::make_shared<WriterInBetween>(moment, write);
    DatabaseOptions options;
    options.read_only = true;
    options.file_system = file_system;
    const auto reader = MustOpen(folder / "db", options);
    ASSERT_NE(reader, nullptr);
    EXPECT_EQ(CountImages(*reader) + 1, reader->GetSnapshot()->GetState()->next_image);
    reached = file_system->has_written();
  }
}

TEST(HeldFiles, ReaderLeavesNothingBehindAndChangesNothing) {
  const TemporaryFolder folder;
  auto database = MustCreate(folder / "db");
  ASSERT_OK(AddImage(*database, 1, kPhotoBytes));
  ASSERT_OK(database->Compact());
  const auto list = [&] {
    std::map<std::string, std::filesystem::file_time_type> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder / "db"))
      files[entry.path().filename()] = entry.last_write_time();
    return files;
  };
  database.reset();
  const auto before = list();
  const auto reader = MustOpen(folder / "db", {.read_only = true});
  ASSERT_NE(reader, nullptr);
  EXPECT_OK(reader->GetSnapshot()->GetPhoto(SampleHash(1)));
  EXPECT_EQ(list(), before);
}

}  // namespace
}  // namespace veduta
