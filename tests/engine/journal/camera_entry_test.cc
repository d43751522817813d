// SPDX-License-Identifier: Apache-2.0
// Goal: a camera comes back whole from its entry in the journal, and nothing else is taken for one.
// Method: a camera with every field set, and with an odd name; entries of older programs and broken
//   ones.
#include "engine/journal/camera_entry.h"

#include <gtest/gtest.h>

namespace veduta {
namespace {

TEST(CameraEntry, IsReadBackAsTheSameCamera) {
  CameraRecord camera{CameraId(3), "a: b (camera 7): c", {}, "somewhere"};
  camera.model = {1536, 1024, 1379.74, 1382.08, 760.095, 503.155, -0.1, 0.02, 700.5, 500.25};
  CameraModel other = camera.model;
  other.fx = 1300.25, other.k1 = 0;
  for (const int variant : {0, 1, 2, 3}) {
    const bool is_refinable = variant % 2 == 1;
    camera.is_refinable = is_refinable;
    camera.refined_from = variant < 2 ? std::nullopt : std::optional(other);
    const auto read = ParseCameraEntry(CameraEntry(camera));
    ASSERT_TRUE(read.has_value()) << CameraEntry(camera);
    EXPECT_EQ(read->id, camera.id);
    EXPECT_EQ(read->name, camera.name);
    EXPECT_EQ(read->model, camera.model);
    EXPECT_EQ(read->is_refinable, is_refinable);
    EXPECT_EQ(read->refined_from, camera.refined_from);
  }
}

TEST(CameraEntry, OthersAreNotTakenForOne) {
  for (const char* text :
       {"", "canon", "canon: 3x3 1,1,1,1", "canon (camera 0): 512x384 450,450,255,191",
        "canon (camera 1): 512x384", "canon (camera 1): 512 450,450,255,191",
        "canon (camera 1): 512x384 450,450,255,191 from 1,2",
        "canon (camera x): 512x384 450,450,255,191", "canon (camera 1): 512x384 refinable",
        " (camera 1): 512x384 450,450,255,191"})
    EXPECT_FALSE(ParseCameraEntry(text).has_value()) << text;
}

}  // namespace
}  // namespace veduta
