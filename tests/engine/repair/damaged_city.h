// SPDX-License-Identifier: Apache-2.0
#pragma once
// One street database, made once and copied for each test, and ways to damage a copy of it.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "storage/records/families.h"
#include "tests/engine/street_fixture.h"
#include "tests/storage/damage.h"

namespace veduta {

inline constexpr int kStreetPhotos = 9;

// All records lie in tables and blob files; there is a vocabulary.
inline const City& WholeCity() {
  static City* const city = [] {
    CityOptions options = City::Options(2);
    options.ingest.retrieval.compare_all_max = 6;
    City* made = new City(options);
    made->Add(Walk(4, 1.2, kStreetPhotos));
    // A photo that is rejected.
    made->AddOne("notes.txt", std::vector<uint8_t>{'n', 'o'});
    EXPECT_OK(made->parts().database->Compact());
    return made;
  }();
  return *city;
}

inline std::string FileBytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

inline void FlipByte(const std::string& path, uint64_t offset) {
  // A new file: the old one may be linked elsewhere.
  std::string bytes = FileBytes(path);
  ASSERT_LT(offset, bytes.size()) << path;
  bytes[offset] ^= 0x10;
  std::filesystem::remove(path);
  std::ofstream(path, std::ios::binary) << bytes;
}

inline std::vector<std::string> FilesWith(const std::string& folder, const std::string& extension) {
  std::vector<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == extension) files.push_back(entry.path().string());
  }
  return files;
}

// A closed copy of the whole city, in a folder of its own.
class DamagedCity {
 public:
  DamagedCity() {
    const City& whole = WholeCity();
    EXPECT_OK(whole.parts().database->CreateCheckpoint(path()));
    digest_ = whole.Digest();
  }

  std::string path() const { return folder_ / "db"; }
  const std::string& digest() const { return digest_; }  // before the damage
  const TemporaryFolder& folder() const { return folder_; }

  // Damages the first block of every table of the family.
  void DamageTables(Family family) const {
    for (const std::string& file : TablesOf(family)) FlipByte(file, 12);
  }
  void DeleteTables(Family family) const {
    for (const std::string& file : TablesOf(family)) std::filesystem::remove(file);
  }
  // Flips a byte of the stored value that begins with these bytes, somewhat after its beginning.
  void DamageBlob(const std::string& beginning) const {
    for (const std::string& file : FilesWith(path(), ".blob")) {
      const size_t at = FileBytes(file).find(beginning);
      if (at != std::string::npos) return FlipByte(file, at + beginning.size() + 200);
    }
    ADD_FAILURE() << "no blob file has the value";
  }
  void DamagePhoto(const std::vector<uint8_t>& bytes) const {
    DamageBlob(std::string(bytes.begin(), bytes.begin() + 3000));
  }
  void Overwrite(Family family, const std::string& key, const std::string& value) const {
    WithRocksdb(
        path(),
        [&](rocksdb::DB& db, rocksdb::ColumnFamilyHandle* handle) {
          ASSERT_TRUE(db.Put({}, handle, key, value).ok());
        },
        family);
  }

 private:
  std::vector<std::string> TablesOf(Family family) const {
    std::vector<std::string> files;
    WithRocksdb(
        path(),
        [&](rocksdb::DB& db, rocksdb::ColumnFamilyHandle* handle) {
          rocksdb::ColumnFamilyMetaData data;
          db.GetColumnFamilyMetaData(handle, &data);
          for (const auto& level : data.levels) {
            for (const auto& file : level.files) files.push_back(path() + file.name);
          }
        },
        family);
    EXPECT_FALSE(files.empty());
    return files;
  }

  TemporaryFolder folder_;
  std::string digest_;
};

}  // namespace veduta
