// SPDX-License-Identifier: Apache-2.0
#include "storage/records/message.h"

namespace veduta {

AlignedValue::AlignedValue(std::string_view value) {
  const size_t count = value.size() / sizeof(capnp::word);
  if (reinterpret_cast<uintptr_t>(value.data()) % sizeof(capnp::word) == 0) {
    words_ = kj::arrayPtr(reinterpret_cast<const capnp::word*>(value.data()), count);
    return;
  }
  copy_ = kj::heapArray<capnp::word>(count);
  std::memcpy(copy_.begin(), value.data(), count * sizeof(capnp::word));
  words_ = copy_;
}

capnp::ReaderOptions LimitsFor(std::string_view value) {
  capnp::ReaderOptions options;
  options.traversalLimitInWords = 4 * (value.size() / sizeof(capnp::word)) + 64;
  options.nestingLimit = 8;
  return options;
}

std::string Flatten(capnp::MessageBuilder& builder) {
  const auto segments = builder.getSegmentsForOutput();
  if (segments.size() != 1) {
    const kj::Array<capnp::word> flat = capnp::messageToFlatArray(segments);
    const auto bytes = flat.asBytes();
    return {reinterpret_cast<const char*>(bytes.begin()), bytes.size()};
  }
  // Segment count less one, then the segment's size in words: capnp's framing of a single segment.
  const uint32_t table[2] = {0, static_cast<uint32_t>(segments[0].size())};
  const auto bytes = segments[0].asBytes();
  std::string value;
  value.reserve(sizeof(table) + bytes.size());
  value.append(reinterpret_cast<const char*>(table), sizeof(table));
  value.append(reinterpret_cast<const char*>(bytes.begin()), bytes.size());
  return value;
}

}  // namespace veduta
