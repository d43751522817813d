// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/number_text.h"

#include <array>
#include <charconv>

namespace veduta {

std::string NumberText(double value) {
  std::array<char, 32> buffer;
  const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return error == std::errc() ? std::string(buffer.data(), end) : std::string("?");
}

}  // namespace veduta
