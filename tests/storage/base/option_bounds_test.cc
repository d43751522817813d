// SPDX-License-Identifier: Apache-2.0
// Goal: a violated bound is named with its value, in one sentence, and the first one is kept; what
//   lies within its bounds is accepted, and what is not a number is not.
// Method: each kind of bound with values below, at and above its ends, and with NaN and infinity;
//   the sentences are compared whole.
#include "storage/base/option_bounds.h"

#include <gtest/gtest.h>

#include <initializer_list>
#include <limits>

namespace veduta {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

// Calls check(bounds, value) for each value: only `right` may pass.
template <typename Check>
void Expect(const Check& check, std::initializer_list<double> wrong,
            std::initializer_list<double> right) {
  for (const double value : wrong) {
    OptionBounds bounds;
    check(bounds, value);
    EXPECT_EQ(bounds.status().code(), StatusCode::kInvalidArgument) << value;
  }
  for (const double value : right) {
    OptionBounds bounds;
    check(bounds, value);
    EXPECT_TRUE(bounds.status().ok()) << bounds.status().message();
  }
}

TEST(OptionBounds, EveryKindOfBoundKnowsItsEnds) {
  Expect([](OptionBounds& b, double v) { b.AtLeast("n", v, 2); }, {-3, 1.9, kNan}, {2, 3, kInf});
  Expect([](OptionBounds& b, double v) { b.Above("n", v, 2); }, {1, 2, kNan}, {2.1, kInf});
  Expect([](OptionBounds& b, double v) { b.FiniteAbove("n", v, 2); }, {2, kInf, kNan}, {2.1, 9});
  Expect([](OptionBounds& b, double v) { b.Finite("n", v); }, {-kInf, kInf, kNan}, {-1, 0, 1});
  Expect([](OptionBounds& b, double v) { b.Between("n", v, 1, 2); }, {0, 2.1, kNan}, {1, 1.5, 2});
  Expect([](OptionBounds& b, double v) { b.AboveUpTo("n", v, 1, 2); }, {1, 2.1, kNan}, {1.5, 2});
  Expect([](OptionBounds& b, double v) { b.Inside("n", v, 1, 2); }, {1, 2, kNan}, {1.1, 1.9});
}

TEST(OptionBounds, TheMessageIsASentence) {
  const auto text = [](const OptionBounds& bounds) { return bounds.status().message(); };
  EXPECT_EQ(text(OptionBounds().AtLeast("count", 0, 4)), "count is 0, but must be 4 or more");
  EXPECT_EQ(text(OptionBounds().Above("step", 0, 0.5)), "step is 0, but must be more than 0.5");
  EXPECT_EQ(text(OptionBounds().FiniteAbove("sigma", kInf, 0)),
            "sigma is inf, but must be finite and more than 0");
  EXPECT_EQ(text(OptionBounds().Finite("center", kNan)), "center is nan, but must be finite");
  EXPECT_EQ(text(OptionBounds().Between("share", 1.5, 0, 1)),
            "share is 1.5, but must be from 0 to 1");
  EXPECT_EQ(text(OptionBounds().AboveUpTo("share", 0, 0, 1)),
            "share is 0, but must be more than 0 and at most 1");
  EXPECT_EQ(text(OptionBounds().Inside("share", 1, 0, 1)),
            "share is 1, but must be more than 0 and less than 1");
  EXPECT_EQ(text(OptionBounds().Require("odd", 2, false, "odd")), "odd is 2, but must be odd");
}

TEST(OptionBounds, NumbersAreShownWhole) {
  const auto text = [](double value) {
    return OptionBounds().Require("n", value, false, "").status().message();
  };
  EXPECT_EQ(text(1099511627777.0), "n is 1099511627777, but must be ");  // 2^40 + 1
  EXPECT_EQ(text(1e-9), "n is 1e-09, but must be ");
  EXPECT_EQ(text(-0.00012345), "n is -0.00012345, but must be ");
  EXPECT_EQ(text(0.1f), "n is 0.1000000015, but must be ");
}

TEST(OptionBounds, TheFirstViolationIsKept) {
  const Status status =
      OptionBounds().AtLeast("a", 1, 1).AtLeast("b", 0, 1).AtLeast("c", 0, 1).status();
  EXPECT_EQ(status.message(), "b is 0, but must be 1 or more");
}

TEST(OptionBounds, PartsLeadTheMessageWithTheirNames) {
  const Status inner = OptionBounds().AtLeast("pixels_max", 0, 1).status();
  const Status outer = OptionBounds().Part("limits", inner).status();
  EXPECT_EQ(outer.code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(OptionBounds().Part("prepare", outer).status().message(),
            "prepare.limits.pixels_max is 0, but must be 1 or more");
  EXPECT_TRUE(OptionBounds().Part("limits", Status::Ok()).status().ok());
  EXPECT_EQ(OptionBounds().AtLeast("a", 0, 1).Part("limits", inner).status().message(),
            "a is 0, but must be 1 or more");
}

}  // namespace
}  // namespace veduta
