// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which image people mean.

#include <string>

#include "engine/door/moderation.h"
#include "storage/database.h"

namespace veduta {

// So many digits of a photo's hash tell it from a name and from other photos. Chosen by hand.
inline constexpr size_t kHashDigitsMin = 8;

// The image by "#" and its number; by its photo's SHA-256 in hexadecimal; by its name; by its
// contributor, a slash and its name; or by the first kHashDigitsMin or more digits of that hash. In
// this order: no name can stand in for a number or a hash. Images that are not in sight are passed
// over, as if they were not there. kNotFound names the text; kInvalidArgument says of texts that
// mean several images which those are. Thread-safe.
Result<ImageRecord> FindImage(const Snapshot& snapshot, const std::string& text,
                              const Sight& sight = {});

}  // namespace veduta
