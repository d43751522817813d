// SPDX-License-Identifier: Apache-2.0
#pragma once
// The program of an operator that tells which areas of a picture are private.
//
// It is started without arguments, by no shell. On its standard input is a JPEG of the photo as it
// stands upright, without anything else that came with it; the input is a file in memory, so a
// program may also open /dev/stdin. It answers by a JSON object on its standard output:
//   {"width": W, "height": H, "areas": [[x, y, width, height], ...]}
// W and H are the size of the picture in which the areas are measured, which has to be that of the
// picture it was given: so areas that were found in a smaller one are not taken for its own.
// Pixels count from 0 at the top left; fractions are rounded outwards. Where nothing is private,
// `areas` is empty: silence is a failure.

#include <atomic>
#include <chrono>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/camera/private_areas.h"
#include "storage/base/status.h"

namespace veduta {

struct BlurCommandLimits {
  std::chrono::milliseconds time_max{60'000};  // until the program has ended; chosen by hand
  size_t output_bytes_max = 1 << 20;           // of kPrivateAreasMax areas, amply
};

// The areas that such an answer names, within the picture. kInvalidArgument says what is wrong: no
// such object, another size, an area that has no size or lies beside the picture, too many.
Result<std::vector<PixelArea>> ParseBlurAnswer(std::string_view answer, ImageSize picture);

// Runs the program on the picture, and ends it with all that it has started in its process group
// where it takes too long, says too much, or `stop` becomes true. Thread-safe. kBusy says why there
// is no answer: it cannot be started, ended with another code than 0, or gave none that can be
// believed.
Result<std::vector<PixelArea>> AskBlurCommand(const std::string& program,
                                              std::span<const uint8_t> jpeg, ImageSize picture,
                                              const BlurCommandLimits& limits,
                                              const std::atomic<bool>& stop);

}  // namespace veduta
