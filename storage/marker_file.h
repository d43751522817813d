// SPDX-License-Identifier: Apache-2.0
#pragma once
// The file that says that a folder is a database of ours. It is written first, and its bytes are
// what processes lock.

namespace veduta {

inline constexpr const char* kMarkerFile = "VEDUTA";

}  // namespace veduta
