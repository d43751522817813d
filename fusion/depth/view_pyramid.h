// SPDX-License-Identifier: Apache-2.0
#pragma once
// A gray view at half its size.

#include "storage/model/view.h"

namespace veduta {

// Each pixel is the mean of four; an odd last row or column is left out. The camera is scaled
// in the same way. Both sides must be at least 2 px. Only the gray image is made.
View HalveView(const View& view);

}  // namespace veduta
