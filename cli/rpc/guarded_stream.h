// SPDX-License-Identifier: Apache-2.0
#pragma once
// The messages of one connection, with limits on what a stranger sends.

#include <capnp/serialize-async.h>
#include <kj/async-io.h>
#include <kj/timer.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <unordered_set>

namespace veduta {

struct MessageLimits {
  // Of one message with its table of segments, in words of 8 bytes: `messageBytesMax`.
  uint64_t words_max = 128 << 10;
  uint32_t segments_max = 64;
  // From the first byte of a message to its last one.
  kj::Duration message_time = 30 * kj::SECONDS;
  // Questions whose answers the client has not finished with: the daemon holds each until then.
  size_t questions_max = 4096;
  // While so many bytes of answers wait for the client to read them, nothing more is read of it.
  size_t queue_bytes_max = 4 << 20;
  // The same of a client that has not logged in: all connections together may be strangers', so
  // these have to be small. A longer message waits for the login that was sent before it.
  uint64_t words_max_of_stranger = 2 << 10;
  size_t queue_bytes_max_of_stranger = 64 << 10;
};

// Reads messages by itself, and has Cap'n Proto write them. What breaks a limit rejects the
// reading, by which the connection ends. Memory for a message is taken once its length is known and
// allowed, and is filled as it comes. `stream` and `timer` must outlive it.
class GuardedStream final : public capnp::MessageStream {
 public:
  GuardedStream(kj::AsyncIoStream* stream, kj::Timer* timer, const MessageLimits& limits = {})
      : stream_(*stream),
        timer_(*timer),
        limits_(limits),
        written_(*stream),
        last_read_(timer->now()) {}

  // Tells how many bytes of answers wait to be sent. To be set before the first message is read.
  void AskQueue(std::function<size_t()> queue_bytes) { queue_bytes_ = std::move(queue_bytes); }

  // Tells whether the client is one that has not logged in. To be set before the first message is
  // read; until then it is none.
  void AskStranger(std::function<bool()> is_stranger) { is_stranger_ = std::move(is_stranger); }

  // When the last message was complete, by the timer; before the first one, when this was made.
  kj::TimePoint last_read() const { return last_read_; }

  kj::Promise<kj::Maybe<capnp::MessageReaderAndFds>> tryReadMessage(
      kj::ArrayPtr<kj::AutoCloseFd> fds, capnp::ReaderOptions options,
      kj::ArrayPtr<capnp::word> scratch) override;
  kj::Promise<void> writeMessage(
      kj::ArrayPtr<const int> fds,
      kj::ArrayPtr<const kj::ArrayPtr<const capnp::word>> segments) override {
    return written_.writeMessage(fds, segments);
  }
  kj::Promise<void> writeMessages(
      kj::ArrayPtr<kj::ArrayPtr<const kj::ArrayPtr<const capnp::word>>> messages) override {
    return written_.writeMessages(messages);
  }
  kj::Maybe<int> getSendBufferSize() override { return written_.getSendBufferSize(); }
  kj::Promise<void> end() override { return written_.end(); }

 private:
  using Message = kj::Own<capnp::MessageReader>;
  // Waits until at least one byte is in the buffer; false at the end.
  kj::Promise<bool> Fill();
  // Takes all these bytes: from the buffer, and what is not there yet from the stream.
  kj::Promise<void> Read(kj::ArrayPtr<kj::byte> bytes);
  kj::Promise<Message> ReadMessage(capnp::ReaderOptions options);
  // Reads what follows the table of segments, once so long a message may come.
  kj::Promise<Message> ReadBody(kj::Array<capnp::word> table, capnp::ReaderOptions options);
  bool is_stranger() const { return is_stranger_ && is_stranger_(); }
  // Counts the questions that are open.
  void Count(capnp::MessageReader* message);

  kj::AsyncIoStream& stream_;
  kj::Timer& timer_;
  const MessageLimits limits_;
  capnp::AsyncIoMessageStream written_;
  std::function<size_t()> queue_bytes_;
  std::function<bool()> is_stranger_;
  // What has come and was not taken: small messages, which come together, are read at once. Chosen
  // by hand.
  kj::Array<kj::byte> buffer_ = kj::heapArray<kj::byte>(4096);
  kj::ArrayPtr<kj::byte> unread_;  // of the buffer
  uint32_t head_[2] = {0, 0};      // segments less one; words of the first
  std::unordered_set<uint32_t> questions_;
  kj::TimePoint last_read_;
};

}  // namespace veduta
