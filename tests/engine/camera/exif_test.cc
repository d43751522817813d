// SPDX-License-Identifier: Apache-2.0
// Goal: what a camera says of itself is read from a block of EXIF; what is broken or senseless is
//   as good as absent.
// Method: blocks that exiv2 writes, cut short and with flipped bytes.
#include "engine/camera/exif.h"

#include <gtest/gtest.h>

#include "tests/engine/camera/exif_writer.h"

namespace veduta {
namespace {

using testing::ExifOf;
using testing::FileBytes;

const ExifCamera kPhone{"Apple", "iPhone 12", "wide lens", 4.2, 1.5};

TEST(Exif, IsReadAsItWasWritten) {
  EXPECT_EQ(ReadExifCamera(ExifOf(kPhone)), kPhone);
  EXPECT_EQ(ReadExifCamera(ExifOf({})), ExifCamera());
  EXPECT_EQ(ReadExifCamera({}), ExifCamera());
}

TEST(Exif, SenselessTextsAndNumbersAreAbsent) {
  const ExifCamera read =
      ReadExifCamera(ExifOf({"  Maker  ", "a\x1b[31mb", std::string(65, 'x'), 20'000, 0}));
  EXPECT_EQ(read, (ExifCamera{"Maker", "", "", 0, 0}));
}

TEST(Exif, BrokenBlocksTellNothingOrSomething) {
  const FileBytes whole = ExifOf(kPhone);
  for (size_t size = 0; size < whole.size(); ++size) {
    const ExifCamera read = ReadExifCamera({whole.data(), size});
    EXPECT_TRUE(read.model.empty() || read.model == kPhone.model) << size;
  }
  for (size_t i = 0; i < whole.size(); ++i) {
    FileBytes flipped = whole;
    flipped[i] ^= 0xFF;
    const ExifCamera read = ReadExifCamera(flipped);
    EXPECT_LE(read.model.size(), 64u) << i;
    EXPECT_GE(read.focal_mm, 0) << i;
  }
}

}  // namespace
}  // namespace veduta
