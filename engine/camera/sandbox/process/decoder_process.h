// SPDX-License-Identifier: Apache-2.0
#pragma once
// The process that has photos decoded. It sees no byte of them itself: it starts a child for each
// photo, which locks itself in (lockdown.h) before it looks at the photo, and ends with it. So no
// photo meets what another one has left behind, and to start a child takes a fork of a small
// process with one thread.

namespace veduta {

// Serves the program at the other end of the socket until that is gone; the exit code of the
// process, which must have one thread.
int RunDecoderProcess(int control);

}  // namespace veduta
