// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the Check() of an options struct is written with: it names the first bound that a value
// violates, with the value.

#include <cmath>
#include <sstream>
#include <string>

#include "storage/base/status.h"

namespace veduta {

// Takes one call for each field, in the order of the fields. The first violation is kept, as
// kInvalidArgument: "inlier_count_min is 0, but must be 4 or more". Every comparison is written so
// that a value that is not a number (NaN) violates its bound.
class OptionBounds final {
 public:
  OptionBounds& AtLeast(const char* name, double value, double bound) {
    return Require(name, value, value >= bound, Text(bound) + " or more");
  }
  OptionBounds& Above(const char* name, double value, double bound) {
    return Require(name, value, value > bound, "more than " + Text(bound));
  }
  // More than `bound`, and not infinite.
  OptionBounds& FiniteAbove(const char* name, double value, double bound) {
    return Require(name, value, value > bound && std::isfinite(value),
                   "finite and more than " + Text(bound));
  }
  OptionBounds& Finite(const char* name, double value) {
    return Require(name, value, std::isfinite(value), "finite");
  }
  // From `low` to `high`, both allowed.
  OptionBounds& Between(const char* name, double value, double low, double high) {
    return Require(name, value, value >= low && value <= high,
                   "from " + Text(low) + " to " + Text(high));
  }
  // More than `low`, and `high` at most.
  OptionBounds& AboveUpTo(const char* name, double value, double low, double high) {
    return Require(name, value, value > low && value <= high,
                   "more than " + Text(low) + " and at most " + Text(high));
  }
  // More than `low` and less than `high`.
  OptionBounds& Inside(const char* name, double value, double low, double high) {
    return Require(name, value, value > low && value < high,
                   "more than " + Text(low) + " and less than " + Text(high));
  }
  // `bound` completes the sentence "..., but must be".
  OptionBounds& Require(const char* name, double value, bool holds, const std::string& bound) {
    if (status_.ok() && !holds) {
      status_ = Status::InvalidArgument(std::string(name) + " is " + Text(value) +
                                        ", but must be " + bound);
    }
    return *this;
  }
  // The check of a struct inside this one: its message is led by the struct's name and a dot.
  OptionBounds& Part(const char* name, const Status& part) {
    if (status_.ok() && !part.ok())
      status_ = Status(part.code(), std::string(name) + "." + part.message());
    return *this;
  }

  const Status& status() const { return status_; }

 private:
  static std::string Text(double value) {
    std::ostringstream text;
    // Counts, of bytes too, are shown whole: below 10^15 a double holds every integer.
    const bool is_count = std::abs(value) < 1e15 && std::trunc(value) == value;
    text.precision(is_count ? 15 : 10);
    text << value;
    return text.str();
  }

  Status status_;
};

}  // namespace veduta
