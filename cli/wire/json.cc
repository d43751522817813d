// SPDX-License-Identifier: Apache-2.0
#include "cli/wire/json.h"

namespace veduta {

std::string JsonLine(const Json& value) {
  return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace veduta
