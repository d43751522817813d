// SPDX-License-Identifier: Apache-2.0
#pragma once
// Cap'n Proto messages as values: one framed message of one or more segments
// (capnp::messageToFlatArray's layout). kj's exceptions end here.

#include <capnp/message.h>
#include <capnp/serialize.h>
#include <kj/exception.h>

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "storage/base/status.h"

namespace veduta {

static_assert(std::endian::native == std::endian::little,
              "rows are little-endian and copied as they lie");

// A value that can be read in place. Cap'n Proto wants 8-byte alignment, which values inside a
// block do not have: then, and only then, the constructor copies.
class AlignedValue final {
 public:
  explicit AlignedValue(std::string_view value);
  kj::ArrayPtr<const capnp::word> words() const { return words_; }

 private:
  kj::Array<capnp::word> copy_;
  kj::ArrayPtr<const capnp::word> words_;
};

// Limits that a value's own size sets: no field of ours is visited more than a few times, so a
// message that makes a reader walk further is damaged.
capnp::ReaderOptions LimitsFor(std::string_view value);

// Calls visit(Root::Reader) -> Status on the message in `value`; kCorruption where the bytes are
// none.
template <typename Root, typename Visit>
Status ReadMessage(std::string_view value, Visit&& visit) {
  if (value.empty() || value.size() % sizeof(capnp::word) != 0) {
    return Status::Corruption("a message of " + std::to_string(value.size()) + " bytes");
  }
  try {
    const AlignedValue aligned(value);
    capnp::FlatArrayMessageReader reader(aligned.words(), LimitsFor(value));
    if (reader.getEnd() != aligned.words().end())
      return Status::Corruption("bytes after the message");
    return visit(reader.getRoot<Root>());
  } catch (const kj::Exception& exception) {
    return Status::Corruption(exception.getDescription().cStr());
  }
}

// The message's bytes, in one copy.
std::string Flatten(capnp::MessageBuilder& builder);

// Calls fill(Root::Builder) and returns the message. `payload_bytes` (all text and data) makes it
// one segment. kInvalidArgument when a list is longer than the format can say.
template <typename Root, typename Fill>
Result<std::string> WriteMessage(size_t payload_bytes, Fill&& fill) {
  try {
    // 64 words hold the root of every record and the padding of its lists.
    capnp::MallocMessageBuilder builder(
        static_cast<capnp::uint>(64 + payload_bytes / sizeof(capnp::word)));
    fill(builder.initRoot<Root>());
    return Flatten(builder);
  } catch (const kj::Exception& exception) {
    return Status::InvalidArgument(exception.getDescription().cStr());
  }
}

// A span of rows as a Data field.
template <typename Row>
capnp::Data::Reader AsData(const Row* rows, size_t count) {
  static_assert(std::is_trivially_copyable_v<Row>);
  return {reinterpret_cast<const kj::byte*>(rows), count * sizeof(Row)};
}
template <typename Row>
capnp::Data::Reader AsData(const std::vector<Row>& rows) {
  return AsData(rows.data(), rows.size());
}

// Replaces `rows` with those in `bytes`; false when they do not divide into rows.
template <typename Row>
bool CopyRows(const void* bytes, size_t size_bytes, std::vector<Row>* rows) {
  static_assert(std::is_trivially_copyable_v<Row>);
  if (size_bytes % sizeof(Row) != 0) return false;
  rows->resize(size_bytes / sizeof(Row));
  if (size_bytes > 0) std::memcpy(static_cast<void*>(rows->data()), bytes, size_bytes);
  return true;
}
template <typename Row>
bool CopyRows(capnp::Data::Reader data, std::vector<Row>* rows) {
  return CopyRows(data.begin(), data.size(), rows);
}

}  // namespace veduta
