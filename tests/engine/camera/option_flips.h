// SPDX-License-Identifier: Apache-2.0
#pragma once
// Tests of the Check() of options structs: each field out of its bounds must be refused by name.

#include <gtest/gtest.h>

#include <initializer_list>
#include <limits>
#include <string>

#include "storage/base/status.h"

namespace veduta::testing {

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInf = std::numeric_limits<double>::infinity();

// Options that are the default but for one field, which takes each of `values`.
template <typename Options, typename Field>
void ExpectRefused(Field Options::*field, const std::string& name,
                   std::initializer_list<Field> values) {
  for (const Field& value : values) {
    Options options;
    options.*field = value;
    const Status status = options.Check();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << name << " = " << value;
    EXPECT_EQ(status.message().rfind(name + " is ", 0), 0u) << status.message();
  }
}

template <typename Options, typename Field>
void ExpectAccepted(Field Options::*field, std::initializer_list<Field> values) {
  for (const Field& value : values) {
    Options options;
    options.*field = value;
    EXPECT_TRUE(options.Check().ok()) << value << ": " << options.Check().message();
  }
}

}  // namespace veduta::testing
