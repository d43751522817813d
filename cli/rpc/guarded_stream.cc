// SPDX-License-Identifier: Apache-2.0
#include "cli/rpc/guarded_stream.h"

#include <capnp/rpc.capnp.h>
#include <capnp/serialize.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <string>
#include <utility>

#include "cli/rpc/rpc_failure.h"

namespace veduta {
namespace {

// Between two looks at whether the client has read enough, or has logged in, to be listened to
// again.
constexpr kj::Duration kPause = 5 * kj::MILLISECONDS;

static_assert(std::endian::native == std::endian::little, "lengths of segments are little-endian");

uint32_t NumberAt(const kj::Array<capnp::word>& table, size_t i) {
  uint32_t number = 0;
  std::memcpy(&number, table.asBytes().begin() + sizeof number * i, sizeof number);
  return number;
}

}  // namespace

kj::Promise<kj::Maybe<capnp::MessageReaderAndFds>> GuardedStream::tryReadMessage(
    kj::ArrayPtr<kj::AutoCloseFd> fds, capnp::ReaderOptions options,
    kj::ArrayPtr<capnp::word> scratch) {
  using Came = kj::Maybe<capnp::MessageReaderAndFds>;
  const size_t queue_bytes_max =
      is_stranger() ? limits_.queue_bytes_max_of_stranger : limits_.queue_bytes_max;
  if (queue_bytes_ && queue_bytes_() > queue_bytes_max) {
    return timer_.afterDelay(kPause).then(
        [this, fds, options, scratch] { return tryReadMessage(fds, options, scratch); });
  }
  return Fill().then([this, options](bool is_there) -> kj::Promise<Came> {
    if (!is_there) return Came(nullptr);
    return timer_.timeoutAfter(limits_.message_time, ReadMessage(options))
        .then([this](Message message) -> Came {
          last_read_ = timer_.now();
          Count(message.get());
          return capnp::MessageReaderAndFds{kj::mv(message), nullptr};
        });
  });
}

kj::Promise<bool> GuardedStream::Fill() {
  if (unread_.size() > 0) return true;
  return stream_.tryRead(buffer_.begin(), 1, buffer_.size()).then([this](size_t read) {
    unread_ = buffer_.slice(0, read);
    return read > 0;
  });
}

kj::Promise<void> GuardedStream::Read(kj::ArrayPtr<kj::byte> bytes) {
  const size_t there = std::min(bytes.size(), unread_.size());
  std::copy_n(unread_.begin(), there, bytes.begin());
  unread_ = unread_.slice(there, unread_.size());
  if (there == bytes.size()) return kj::READY_NOW;
  return stream_.read(bytes.begin() + there, bytes.size() - there);
}

kj::Promise<GuardedStream::Message> GuardedStream::ReadMessage(capnp::ReaderOptions options) {
  const kj::ArrayPtr<kj::byte> head(reinterpret_cast<kj::byte*>(head_), sizeof head_);
  return Read(head).then([this, options]() -> kj::Promise<Message> {
    const uint64_t segments = uint64_t{head_[0]} + 1;
    if (segments > limits_.segments_max || head_[1] > limits_.words_max)
      kj::throwFatalException(Failure(413, "a message has too many segments or words"));
    auto table = kj::heapArray<capnp::word>(segments / 2 + 1);
    std::memcpy(table.begin(), head_, sizeof head_);
    auto reading = Read(table.asBytes().slice(sizeof head_, table.asBytes().size()));
    return reading.then([this, options, table = kj::mv(table)]() mutable {
      return ReadBody(kj::mv(table), options);
    });
  });
}

kj::Promise<GuardedStream::Message> GuardedStream::ReadBody(kj::Array<capnp::word> table,
                                                            capnp::ReaderOptions options) {
  uint64_t words = table.size();
  for (size_t i = 0; i <= NumberAt(table, 0); ++i) words += NumberAt(table, i + 1);
  if (words > limits_.words_max) {
    kj::throwFatalException(Failure(413, "a message has " + std::to_string(words) +
                                             " words of 8 bytes, and may have " +
                                             std::to_string(limits_.words_max)));
  }
  // The login may be among the messages before this one, and not have been answered yet.
  if (words > limits_.words_max_of_stranger && is_stranger()) {
    return timer_.afterDelay(kPause).then([this, options, table = kj::mv(table)]() mutable {
      return ReadBody(kj::mv(table), options);
    });
  }
  auto all = kj::heapArray<capnp::word>(words);
  std::memcpy(all.begin(), table.begin(), table.asBytes().size());
  auto body = all.slice(table.size(), all.size());
  return Read(body.asBytes()).then([options, all = kj::mv(all)]() mutable -> Message {
    const auto view = all.asPtr();
    return kj::heap<capnp::FlatArrayMessageReader>(view, options).attach(kj::mv(all));
  });
}

void GuardedStream::Count(capnp::MessageReader* message) {
  const auto root = message->getRoot<capnp::rpc::Message>();
  if (root.isCall()) {
    questions_.insert(root.getCall().getQuestionId());
  } else if (root.isBootstrap()) {
    questions_.insert(root.getBootstrap().getQuestionId());
  } else if (root.isFinish()) {
    questions_.erase(root.getFinish().getQuestionId());
  }
  if (questions_.size() > limits_.questions_max) {
    kj::throwFatalException(Failure(
        429, "more than " + std::to_string(limits_.questions_max) + " questions are unfinished"));
  }
}

}  // namespace veduta
