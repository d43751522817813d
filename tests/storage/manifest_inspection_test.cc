// SPDX-License-Identifier: Apache-2.0
// Goal: a bit that flips in the manifest, a cut of it, and a CURRENT that names an older one are
//   noticed before RocksDB takes an older list of its files for the newest; what a killed process
//   and a power cut leave opens.
// Method: every bit of the manifest of a database whose older files are all still there, so that an
//   older list opens as well as the newest.
#include "storage/manifest_inspection.h"

#include <gtest/gtest.h>

#include "log_damage.h"

namespace veduta {
namespace {

constexpr uint32_t kImages = 6;

std::string ReadBytes(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(stream), {});
}

void WriteBytes(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

class ManifestInspection : public testing::Test {
 protected:
  void SetUp() override {
    for (uint32_t id = 1; id <= kImages; ++id) {
      auto database = id == 1 ? MustCreate(live_) : MustOpen(live_, {});
      ASSERT_OK(AddImage(*database, id));
      ASSERT_OK(database->Compact());
      Keep();
      database.reset();
      Keep();
    }
    manifest_ = path_ + "/" + ReadBytes(path_ + "/CURRENT");
    manifest_.pop_back();
    whole_ = ReadBytes(manifest_);
  }

  // Takes over what is in the folder, and deletes nothing.
  void Keep() {
    std::filesystem::copy(live_, path_,
                          std::filesystem::copy_options::recursive |
                              std::filesystem::copy_options::overwrite_existing);
  }

  Status Check() const {
    const auto mark = ReadAcknowledged(*rocksdb::FileSystem::Default(), path_);
    EXPECT_OK(mark);
    return CheckManifest(path_, *rocksdb::FileSystem::Default(), *mark);
  }
  void ExpectRefused(const std::string& words) {
    for (const bool read_only : {true, false}) {
      const Status status = Database::Open(path_, {.read_only = read_only}).status();
      EXPECT_EQ(status.code(), StatusCode::kCorruption) << status.message();
      EXPECT_NE(status.message().find(words), std::string::npos) << status.message();
      EXPECT_NE(status.message().find("veduta repair " + path_), std::string::npos);
    }
  }

  const TemporaryFolder folder_;
  const std::string live_ = folder_ / "live", path_ = folder_ / "db";
  std::string manifest_, whole_;
};

TEST_F(ManifestInspection, EveryFlippedBitIsNoticed) {
  EXPECT_OK(Check());
  for (size_t byte = 0; byte < whole_.size(); ++byte) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string flipped = whole_;
      flipped[byte] = static_cast<char>(flipped[byte] ^ (1 << bit));
      WriteBytes(manifest_, flipped);
      ASSERT_EQ(Check().code(), StatusCode::kCorruption) << "bit " << bit << " of byte " << byte;
    }
  }
}

// RocksDB by itself opens this, without the last images.
TEST_F(ManifestInspection, DamagedLengthIsNoEnd) {
  std::vector<LogPiece> edits;
  ASSERT_OK(ReadManifest(*rocksdb::FileSystem::Default(), manifest_, [&](const LogPiece& piece) {
    edits.push_back(piece);
    return Status::Ok();
  }));
  ASSERT_GT(edits.size(), 3u);
  for (const LogPiece& edit : edits) {
    std::string flipped = whole_;
    flipped[edit.begin_bytes + 5] ^= 0x40;  // 16 KiB longer
    WriteBytes(manifest_, flipped);
    ExpectRefused("cannot be read from byte " + std::to_string(edit.begin_bytes));
  }
  WriteBytes(manifest_, whole_.substr(0, edits.back().begin_bytes));
  ExpectRefused("ends at byte " + std::to_string(edits.back().begin_bytes));
  WriteBytes(manifest_, whole_);
  EXPECT_EQ(CountImages(*MustOpen(path_, {.read_only = true})), kImages);
}

TEST_F(ManifestInspection, OlderManifestIsNotTakenForTheNewest) {
  uint64_t oldest = UINT64_MAX;
  for (const auto& entry : std::filesystem::directory_iterator(path_)) {
    if (const auto number = ParseManifestName(entry.path().filename().string()))
      oldest = std::min(oldest, *number);
  }
  std::string name = std::to_string(oldest);
  name = "MANIFEST-" + std::string(6 - name.size(), '0') + name;
  ASSERT_NE(path_ + "/" + name, manifest_);
  WriteBytes(path_ + "/CURRENT", name + "\n");
  ExpectRefused("CURRENT names " + name);
  WriteBytes(path_ + "/CURRENT", "no name\n");
  EXPECT_EQ(Check().code(), StatusCode::kCorruption);
}

TEST_F(ManifestInspection, TornEditOfAKilledProcessIsForgiven) {
  auto database = MustOpen(live_, {});
  ASSERT_OK(AddImage(*database, kImages + 1));
  CopyAsKilled(live_, path_);
  std::string name = ReadBytes(path_ + "/CURRENT");
  name.pop_back();
  const std::string whole = ReadBytes(path_ + "/" + name);
  // An edit that had begun: what it says is not so yet.
  for (const size_t size : {size_t{3}, size_t{7}, size_t{20}}) {
    WriteBytes(path_ + "/" + name,
               whole + std::string("\x11\x22\x33\x44\x60\0\1", 7).append(13, 'x').substr(0, size));
    EXPECT_OK(Check()) << size;
    EXPECT_EQ(CountImages(*MustOpen(path_, {.read_only = true})), kImages + 1);
  }
  // One that the mark does not know yet, but that others follow.
  ASSERT_OK(database->Compact());
  CopyAsKilled(live_, path_);
  std::string flipped = ReadBytes(path_ + "/" + name);
  ASSERT_GT(flipped.size(), whole.size());
  flipped[whole.size() + 5] ^= 0x40;
  WriteBytes(path_ + "/" + name, flipped);
  ExpectRefused("cannot be read from byte " + std::to_string(whole.size()));
}

}  // namespace
}  // namespace veduta
