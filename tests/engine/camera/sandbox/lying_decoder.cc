// SPDX-License-Identifier: Apache-2.0
// A decoder process that has been taken over: it greets as an honest one does, and then answers
// requests by what the photo's first byte chooses (sandboxed_decoder_test.cc).
#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstring>

#include "engine/camera/sandbox/control_socket.h"
#include "engine/camera/sandbox/exchange.h"

namespace {

using veduta::DecoderAnswer;
using veduta::DecoderEnd;
using veduta::DecoderRequest;
using veduta::MappedMemory;

// A sound answer for a JPEG of 40 x 30 px, without its pixels.
DecoderAnswer Sound(const DecoderRequest& request) {
  DecoderAnswer answer;
  answer.orientation = answer.sensor_orientation = 1;
  if (request.task == veduta::DecodeTask::kExamine) {
    answer.format = 1;
    answer.width_px = 40;
    answer.height_px = 30;
  }
  return answer;
}

// What becomes of one photo; false where the process ends without an answer.
bool Lie(uint8_t how, const DecoderRequest& request, int memory, DecoderEnd* end) {
  end->is_started = 1;
  const auto mapped = MappedMemory::Map(memory, request.answer_bytes, MappedMemory::Access::kWrite);
  if (!mapped.ok()) return false;
  DecoderAnswer answer = Sound(request);
  switch (how) {
    case 's':  // sound
      break;
    case 'n':  // nonsense from end to end
      std::memset(mapped->data(), 0xa5, mapped->size_bytes());
      return true;
    case 'o':  // an outcome that there is not
      answer.outcome = 77;
      break;
    case 't':  // a text that is longer than its room
      answer.detail.size = 1 << 30;
      break;
    case 'r':  // resizes the memory of the answer
      if (ftruncate(memory, 0) == 0) return false;
      break;
    case 'm':  // says that the memory was too short
      answer.outcome = 3;
      break;
    case 'c':  // claims what the photo may not have
      answer.width_px = answer.height_px = ~0u;
      break;
    case 'x':  // a child that ended by itself
      end->wait_status = 3 << 8;
      return true;
    case 'v':  // a child that a fault has ended
      end->wait_status = SIGSEGV;
      return true;
    case 'k':  // a child that was killed
      end->wait_status = SIGKILL;
      return true;
    case 'd':  // no child
      end->is_started = 0;
      return true;
    default:
      return false;
  }
  std::memcpy(mapped->data(), &answer, sizeof(answer));
  return true;
}

}  // namespace

int main() {
  veduta::DecoderGreeting greeting;
  greeting.is_ready = 1;
  veduta::Send(veduta::kControlDescriptor, greeting);
  for (;;) {
    DecoderRequest request;
    std::array<veduta::Descriptor, 2> memory;
    if (veduta::Receive(veduta::kControlDescriptor, &request, memory, -1) !=
        veduta::Reception::kMessage) {
      return 0;
    }
    const auto photo =
        MappedMemory::Map(memory[0].number(), request.photo_bytes, MappedMemory::Access::kRead);
    DecoderEnd end;
    if (!photo.ok() || !Lie(photo->data()[0], request, memory[1].number(), &end)) return 1;
    veduta::Send(veduta::kControlDescriptor, end);
  }
}
