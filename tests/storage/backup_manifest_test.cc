// SPDX-License-Identifier: Apache-2.0
// Goal: a manifest says what was written, or is refused.
// Method: there and back; every byte changed, every length cut, and names that lead elsewhere.
#include "storage/backup_manifest.h"

#include "tests/storage/samples.h"

namespace veduta {
namespace {

BackupManifest Sample() {
  return {7,
          1'764'000'000,
          "/srv/the city",
          {{"000012.sst", SampleHash(1), 5000, 99, 1'764'000'000'123'456'789},
           {"CURRENT", SampleHash(2), 16, 100, -1}}};
}

TEST(BackupManifest, IsReadAsItWasWritten) {
  const auto read = ParseManifest(ManifestText(Sample()));
  ASSERT_OK(read);
  EXPECT_EQ(read->number, 7u);
  EXPECT_EQ(read->time_unix_s, 1'764'000'000);
  EXPECT_EQ(read->database, "/srv/the city");
  EXPECT_EQ(read->SizeBytes(), 5016u);
  ASSERT_EQ(read->files.size(), 2u);
  EXPECT_EQ(read->files[0].name, "000012.sst");
  EXPECT_EQ(read->files[0].hash, SampleHash(1));
  EXPECT_EQ(read->files[0].inode, 99u);
  EXPECT_EQ(read->files[0].modified_ns, 1'764'000'000'123'456'789);
  EXPECT_EQ(ManifestText(*read), ManifestText(Sample()));
}

TEST(BackupManifest, AnyChangeIsNoticed) {
  const std::string text = ManifestText(Sample());
  for (size_t i = 0; i < text.size(); ++i) {
    std::string changed = text;
    changed[i] = static_cast<char>(changed[i] ^ 1);
    EXPECT_EQ(ParseManifest(changed).status().code(), StatusCode::kCorruption) << i;
    EXPECT_EQ(ParseManifest(text.substr(0, i)).status().code(), StatusCode::kCorruption) << i;
  }
  EXPECT_FALSE(ParseManifest(text + "\n").ok());
}

TEST(BackupManifest, NamesThatLeadElsewhereAreRefused) {
  for (const char* name : {"", ".", "..", "../VEDUTA", "a/b", "a b", "a\nb", ".hidden"}) {
    BackupManifest manifest = Sample();
    manifest.files[0].name = name;
    EXPECT_EQ(ParseManifest(ManifestText(manifest)).status().code(), StatusCode::kCorruption)
        << name;
  }
  BackupManifest twice = Sample();
  twice.files[1].name = twice.files[0].name;
  EXPECT_FALSE(ParseManifest(ManifestText(twice)).ok());
  BackupManifest none = Sample();
  none.number = 0;
  EXPECT_FALSE(ParseManifest(ManifestText(none)).ok());
}

}  // namespace
}  // namespace veduta
