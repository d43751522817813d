// SPDX-License-Identifier: Apache-2.0
#include "cli/service/body_reader.h"

#include <string>
#include <vector>

namespace veduta {
namespace {

// How long a client may take for the next piece of a body. Chosen by hand.
constexpr kj::Duration kPieceTime = 30 * kj::SECONDS;
// Pieces in which a body is read.
constexpr size_t kPieceBytes = 256 << 10;
// Where a body is handed over in parts, one has so much or a piece more. As many connections as
// there may be fit into the memory for bodies.
constexpr size_t kPartBytes = 768 << 10;
// A body that is no larger is taken also where those of others fill the memory: somebody revokes a
// token or hides a photo by it. As many as there may be connections have 32 MiB. Chosen by hand, as
// that of small answers.
constexpr size_t kSmallBodyBytes = 64 << 10;

}  // namespace

kj::Promise<void> BodyReader::ReadAll(kj::AsyncInputStream& body,
                                      std::shared_ptr<Arriving> arriving) const {
  KJ_IF_MAYBE (length, body.tryGetLength()) {
    if (*length == 0 || !Fits(*length, arriving.get())) return kj::READY_NOW;
    // Memory is taken when it is filled.
    arriving->request.body.reserve(*length + kPieceBytes);
  } else if (bytes_max_ == 0) {
    Fits(1, arriving.get());
    return kj::READY_NOW;
  }
  return ReadPieces(body, std::move(arriving), SIZE_MAX);
}

kj::Promise<void> BodyReader::ReadPart(kj::AsyncInputStream& body,
                                       std::shared_ptr<Arriving> arriving) const {
  return ReadPieces(body, std::move(arriving), kPartBytes);
}

kj::Promise<void> BodyReader::ReadPieces(kj::AsyncInputStream& body,
                                         std::shared_ptr<Arriving> arriving,
                                         size_t enough_bytes) const {
  std::vector<uint8_t>& bytes = arriving->request.body;
  const size_t before = bytes.size();
  bytes.resize(before + kPieceBytes);
  return timer_.timeoutAfter(kPieceTime, body.tryRead(&bytes[before], 1, kPieceBytes))
      .then([this, &body, arriving, before, enough_bytes](size_t count) -> kj::Promise<void> {
        arriving->request.body.resize(before + count);
        arriving->has_ended = count == 0;
        if (count == 0 || !Reserve(arriving.get(), before + count)) return kj::READY_NOW;
        if (before + count >= enough_bytes) return kj::READY_NOW;
        return ReadPieces(body, arriving, enough_bytes);
      });
}

bool BodyReader::Fits(uint64_t bytes, Arriving* arriving) const {
  if (bytes > bytes_max_) {
    arriving->refusal =
        Problem(413, bytes_max_ == 0 ? "this request has no body"
                                     : "the body is larger than " + std::to_string(bytes_max_) +
                                           " bytes, the most that is taken");
  }
  return !arriving->refusal;
}

bool BodyReader::Reserve(Arriving* arriving, uint64_t bytes) const {
  if (!Fits(bytes, arriving)) return false;
  const bool may_exceed = bytes <= kSmallBodyBytes || arriving->request.is_of_owner;
  if (!arriving->share->Grow(bytes) && !may_exceed) {
    arriving->refusal = ComeAgain(
        429,
        "the bodies that are arriving fill the memory, or yours half of it: send this one again "
        "later",
        5);
  }
  if (!arriving->refusal) arriving->come_bytes = bytes;
  return !arriving->refusal;
}

}  // namespace veduta
