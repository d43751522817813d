// SPDX-License-Identifier: Apache-2.0
// Goal: a value that is no whole message is refused, whatever is wrong with its frame, and text and
//   rows of any size come through.
// Method: frames broken one by one; a message of several segments.
#include "storage/records/message.h"

#include <gtest/gtest.h>

#include "storage/records/schema.capnp.h"
#include "tests/storage/records/codec_checks.h"

namespace veduta {
namespace {

TEST(Message, BrokenFramesAreCorruption) {
  const auto read = [](std::string_view value) {
    return ReadMessage<schema::Observations>(value, [](auto) { return Status::Ok(); }).code();
  };
  const std::string value = *WriteMessage<schema::Observations>(0, [](auto to) {
    const std::vector<uint32_t> rows = {1, 2, 3};
    to.setRows(AsData(rows));
  });
  EXPECT_EQ(read(value), StatusCode::kOk);
  EXPECT_EQ(read(""), StatusCode::kCorruption);
  EXPECT_EQ(read("1234567"), StatusCode::kCorruption);
  EXPECT_EQ(read(value + "12345678"), StatusCode::kCorruption);
  std::string many = value;
  many[0] = '\x7F';
  EXPECT_EQ(read(many), StatusCode::kCorruption) << "128 segments";
  std::string longer = value;
  longer[4] = '\x7F';
  EXPECT_EQ(read(longer), StatusCode::kCorruption) << "a segment of 127 words";
}

TEST(Message, SeveralSegmentsAreFramedToo) {
  // More data than was announced: the builder begins a second segment.
  const std::vector<uint32_t> rows(100'000, 7);
  const std::string value =
      *WriteMessage<schema::Observations>(0, [&](auto to) { to.setRows(AsData(rows)); });
  std::vector<uint32_t> read;
  ASSERT_OK(ReadMessage<schema::Observations>(value, [&](auto from) {
    return CopyRows(from.getRows(), &read) ? Status::Ok() : Status::Corruption("rows");
  }));
  EXPECT_EQ(read, rows);
}

TEST(Message, OnlyWholeRowsAreCopied) {
  std::vector<uint32_t> rows = {9};
  EXPECT_FALSE(CopyRows("12345", 5, &rows));
  EXPECT_EQ(rows.size(), 1u);
  ASSERT_TRUE(CopyRows("", 0, &rows));
  EXPECT_TRUE(rows.empty());
}

TEST(Message, UnalignedValueIsCopiedAlignedOneIsNot) {
  alignas(8) const char bytes[17] = "0123456789abcdef";
  EXPECT_EQ(AlignedValue({bytes, 16}).words().asBytes().begin(),
            reinterpret_cast<const unsigned char*>(bytes));
  const AlignedValue shifted({bytes + 1, 8});
  EXPECT_EQ(std::string(shifted.words().asChars().begin(), 8), "12345678");
}

}  // namespace
}  // namespace veduta
