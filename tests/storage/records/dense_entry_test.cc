// SPDX-License-Identifier: Apache-2.0
// Goal: a key of the family `dense` begins with the byte of its entry, whose value is stored and so
//   never changes, and then sorts by its id; an id that is cut off or 0 is refused.
// Method: the bytes of keys written down here; ids around every byte boundary, read back.
#include "storage/records/dense_entry.h"

#include <gtest/gtest.h>

#include <string>
#include <string_view>

#include "storage/base/ids.h"

namespace veduta {
namespace {

using std::string_literals::operator""s;

TEST(DenseEntry, KeysHaveTheBytesThatAreStored) {
  EXPECT_EQ(DenseKey(DenseEntry::kSettings, 1), "\x01\x00\x00\x00\x01"s);
  EXPECT_EQ(DenseKey(DenseEntry::kDepth, 256), "\x02\x00\x00\x01\x00"s);
  EXPECT_EQ(DenseKey(DenseEntry::kCheckedDepth, 0x01020304), "\x03\x01\x02\x03\x04"s);
  EXPECT_EQ(DenseKey(DenseEntry::kTile, 0xFFFFFFFF), "\x04\xFF\xFF\xFF\xFF"s);
}

TEST(DenseEntry, KeysSortByEntryThenById) {
  std::string last;
  for (const DenseEntry entry :
       {DenseEntry::kSettings, DenseEntry::kDepth, DenseEntry::kCheckedDepth, DenseEntry::kTile}) {
    for (const uint32_t id : {1u, 255u, 256u, 65535u, 65536u, 0x7FFFFFFFu, 0x80000000u}) {
      const std::string key = DenseKey(entry, id);
      EXPECT_LT(last, key);
      last = key;
    }
  }
}

TEST(DenseEntry, AnIdIsTakenOffOrRefused) {
  for (const uint32_t id : {1u, 255u, 256u, 0x80000000u, 0xFFFFFFFFu}) {
    const std::string key = DenseKey(DenseEntry::kTile, id) + "rest";
    std::string_view rest = std::string_view(key).substr(1);
    ImageId read;
    ASSERT_TRUE(TakeId(&rest, &read));
    EXPECT_EQ(read, ImageId(id));
    EXPECT_EQ(rest, "rest");
  }
  const std::string none = DenseKey(DenseEntry::kTile, 0), whole = DenseKey(DenseEntry::kTile, 7);
  ImageId read;
  std::string_view zero = std::string_view(none).substr(1);
  EXPECT_FALSE(TakeId(&zero, &read));
  std::string_view cut = std::string_view(whole).substr(1, 3);
  EXPECT_FALSE(TakeId(&cut, &read));
}

TEST(DenseEntry, AWrongKeyIsCorruption) {
  EXPECT_EQ(WrongDenseKey().code(), StatusCode::kCorruption);
  EXPECT_EQ(WrongDenseKey().message(), "a key of wrong length, or with id 0");
}

}  // namespace
}  // namespace veduta
