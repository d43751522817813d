// SPDX-License-Identifier: Apache-2.0
// Goal: a sample that any filled pixel has a share of says so, at every size; a photo without
//   filled pixels has none.
// Method: one filled pixel; samples around it at several sizes.
#include "fusion/surface/color_view.h"

#include <gtest/gtest.h>

namespace veduta {
namespace {

View White() {
  View view;
  view.geometry.width_px = 64, view.geometry.height_px = 48;
  view.geometry.camera.fx = view.geometry.camera.fy = 50;
  view.geometry.camera.cx = 31.5, view.geometry.camera.cy = 23.5;
  view.rgb.assign(3 * 64 * 48, 200);
  return view;
}

TEST(ColorView, SaysWhereItIsFilled) {
  View view = White();
  view.filled.assign(64 * 48, 0);
  view.filled[20 * 64 + 30] = 255;
  const auto made = ColorView::Make(view, Eigen::Vector3f::Ones());
  ASSERT_TRUE(made.ok()) << made.status().message();
  for (const double size : {1.0, 2.0, 4.0, 8.0}) {
    EXPECT_TRUE(made->At({30, 20}, size).is_filled) << size;
    EXPECT_FALSE(made->At({30 + 3 * size, 20}, size).is_filled) << size;
    EXPECT_FALSE(made->At({30, 20 - 3 * size}, size).is_filled) << size;
  }
  EXPECT_TRUE(made->At({29.4, 20.3}, 1).is_filled) << "a share of it is enough";
}

TEST(ColorView, IsNotFilledOtherwise) {
  const auto made = ColorView::Make(White(), Eigen::Vector3f::Ones());
  ASSERT_TRUE(made.ok()) << made.status().message();
  EXPECT_FALSE(made->At({30, 20}, 1).is_filled);
  View wrong = White();
  wrong.filled.assign(5, 0);
  EXPECT_EQ(ColorView::Make(wrong, Eigen::Vector3f::Ones()).status().code(),
            StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace veduta
