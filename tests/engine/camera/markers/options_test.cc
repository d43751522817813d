// SPDX-License-Identifier: Apache-2.0
// Goal: the Check() of the options that markers are looked for with accepts the defaults and the
//   ends of the ranges that the headers state, and refuses each field outside of its range by name.
// Method: one field at a time out of its bounds, not-a-number and infinity among the values. The
//   number of fields of each struct is fixed by a structured binding: a new field does not compile
//   until this test knows it.
#include <gtest/gtest.h>

#include "engine/camera/markers/photo_markers.h"
#include "tests/engine/camera/option_flips.h"

namespace veduta {
namespace {

using testing::ExpectAccepted;
using testing::ExpectRefused;
using testing::kInf;
using testing::kNan;

TEST(Options, Marker) {
  using Options = MarkerOptions;
  [[maybe_unused]] const auto [offset, budget, support, ids, sigma] = Options();
  EXPECT_TRUE(Options().Check().ok());
  ExpectRefused(&Options::offset_gray, "offset_gray", {0, -1, 101});
  ExpectAccepted(&Options::offset_gray, {1, 100});
  ExpectRefused(&Options::code_budget, "code_budget", {-1, 7});
  ExpectAccepted(&Options::code_budget, {0, 6});
  ExpectRefused(&Options::support_min, "support_min", {0.49, 1.01, kNan});
  ExpectAccepted(&Options::support_min, {0.5, 1.});
  ExpectRefused(&Options::id_count, "id_count", {0u, kMarkerIdCount + 1});
  ExpectAccepted(&Options::id_count, {1u, kMarkerIdCount});
  ExpectRefused(&Options::sigma_px_max, "sigma_px_max", {0., -1., kNan, kInf});
  MarkerOptions options;
  options.code_budget = 7;
  EXPECT_NE(DetectMarkers({}, options).status().message().find("code_budget"), std::string::npos);
}

TEST(Options, PhotoMarkers) {
  using Options = PhotoMarkersOptions;
  [[maybe_unused]] const auto [markers, decode, count] = Options();
  EXPECT_TRUE(Options().Check().ok());
  ExpectRefused(&Options::marker_count_min, "marker_count_min", {0u});
  ExpectAccepted(&Options::marker_count_min, {1u});
  Options nested;
  nested.markers.offset_gray = 0;
  EXPECT_EQ(nested.Check().message(), "markers.offset_gray is 0, but must be from 1 to 100");
  nested = {};
  nested.decode.pixels_max = 0;
  EXPECT_EQ(nested.Check().message(), "decode.pixels_max is 0, but must be 1 or more");
}

TEST(Options, DecodeLimits) {
  using Options = DecodeLimits;
  [[maybe_unused]] const auto [bytes, pixels, side] = Options();
  EXPECT_TRUE(Options().Check().ok());
  ExpectRefused<Options, uint64_t>(&Options::size_bytes_max, "size_bytes_max", {0});
  ExpectAccepted<Options, uint64_t>(&Options::size_bytes_max, {1});
  ExpectRefused<Options, uint64_t>(&Options::pixels_max, "pixels_max", {0});
  ExpectAccepted<Options, uint64_t>(&Options::pixels_max, {1});
  ExpectRefused(&Options::side_px_max, "side_px_max", {0u, 65536u});
  ExpectAccepted(&Options::side_px_max, {1u, 65535u});
}

}  // namespace
}  // namespace veduta
