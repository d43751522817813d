// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a child of a decoder process does.

#include "engine/camera/sandbox/exchange.h"
#include "engine/camera/sandbox/process/lockdown.h"

namespace veduta {

// Has the libraries do what they do once, and what a process that is shut in may not do. Called
// once, before there are children.
void PrepareToDecode();

// Shuts the process in, does what the request asks for, writes the answer and ends the process: by
// 0, or by another code where the answer could not even be begun. `photo` and `answer` are the
// descriptors of the request's memories.
[[noreturn]] void DecodeShutIn(const Lockdown& lockdown, const DecoderRequest& request, int photo,
                               int answer);

}  // namespace veduta
