// SPDX-License-Identifier: Apache-2.0
#pragma once
// Writes answers to clients that may be slow.

#include <kj/async-io.h>
#include <kj/timer.h>

#include <cstddef>
#include <string_view>

namespace veduta {

// A client has kSendTime to receive so much of an answer, about 17 kB/s. Chosen by hand: a photo of
// 40 MB comes over any line on which one looks at photos, and who does not read at all is cut off
// after a minute.
inline constexpr size_t kSendBytes = 1 << 20;
inline constexpr kj::Duration kSendTime = 60 * kj::SECONDS;

// Writes all of the text, which must live until it is done, as `out` must. Fails (OVERLOADED) where
// the client takes longer than kSendTime for one piece, and where `out` does.
kj::Promise<void> WriteInPieces(kj::Timer* timer, kj::AsyncOutputStream* out,
                                std::string_view text);

}  // namespace veduta
