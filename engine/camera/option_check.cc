// SPDX-License-Identifier: Apache-2.0
#include "engine/camera/option_check.h"

#include <cmath>
#include <string>

#include "engine/camera/camera_text.h"

namespace veduta {

Status CheckFields(const char* options, std::initializer_list<OptionField> fields) {
  for (const OptionField& field : fields) {
    if (field.is_allowed) continue;
    return Status::InvalidArgument(std::string(options) + "." + field.name + " = " +
                                   NumberText(field.value) + " is not in " + field.range);
  }
  return Status::Ok();
}

bool IsPositive(double value) {
  return value > 0 && std::isfinite(value);
}

}  // namespace veduta
