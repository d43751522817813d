// SPDX-License-Identifier: Apache-2.0
#pragma once
// For the tests of options: every bound of a field is noticed, and what lies within is not.

#include <gtest/gtest.h>

#include <initializer_list>
#include <string>

#include "storage/base/status.h"

namespace veduta {

// Sets one field of otherwise default options to each of the numbers: Check must refuse each of
// `wrong` with a message that begins with the field's name, and accept each of `right`.
template <typename Options, typename Field>
void ExpectBounds(Field Options::*field, const std::string& name,
                  std::initializer_list<Field> wrong, std::initializer_list<Field> right) {
  for (const Field value : wrong) {
    Options options;
    options.*field = value;
    const Status status = options.Check();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << name << " " << value;
    EXPECT_EQ(status.message().rfind(name + " is ", 0), 0u) << status.message();
  }
  for (const Field value : right) {
    Options options;
    options.*field = value;
    EXPECT_TRUE(options.Check().ok()) << options.Check().message();
  }
}

}  // namespace veduta
