// SPDX-License-Identifier: Apache-2.0
// Goal: what is filled in a photo has no depth.
// Method: photos of a rendered street with an area filled in each, placed and run through the
//   depth stages of a small pass; their stored depth maps looked at.
#include <gtest/gtest.h>

#include "engine/camera/filled_photo.h"
#include "engine/camera/photo_decoder.h"
#include "fusion/pass/dense_pass.h"
#include "tests/engine/street_fixture.h"

namespace veduta {
namespace {

TEST(FilledAreas, HaveNoDepth) {
  City city;
  std::vector<PhotoSubmission> photos;
  PixelArea area;
  for (const double along_m : {20.0, 20.7, 21.4, 22.1, 22.8, 23.5}) {
    PhotoSubmission photo = city.Submit(Stand{along_m, 90});
    const DecodedPhoto decoded = DecodePhoto(*photo.photo.bytes, {});
    const auto width = static_cast<uint16_t>(decoded.bgr.cols),
               height = static_cast<uint16_t>(decoded.bgr.rows);
    area = {static_cast<uint16_t>(width / 4), static_cast<uint16_t>(height / 4),
            static_cast<uint16_t>(width / 5), static_cast<uint16_t>(height / 3)};
    const auto filled =
        FillPhoto(decoded.bgr, DecoderInProcess().Examine(*photo.photo.bytes), {&area, 1});
    ASSERT_OK(filled);
    photo.photo.bytes = *filled;
    photos.push_back(std::move(photo));
  }
  city.Add(photos);
  const auto records = city.Ask().snapshot().ListReconstructions();
  ASSERT_OK(records);
  ASSERT_EQ(records->size(), 1u);
  DensifyOptions options;
  options.depth_side_px = 96;
  ASSERT_OK(RunDensePass({*city.parts().writer, *city.parts().pool, /*device=*/nullptr, {}, {}},
                         records->front().id, options));
  const auto snapshot = city.parts().database->GetSnapshot();
  size_t maps = 0, known = 0;
  EXPECT_OK(snapshot->dense().ScanDepths([&](const DepthRecord& depth) {
    const auto pixels = snapshot->dense().GetDepthPixels(depth.image);
    EXPECT_OK(pixels);
    ++maps;
    const CameraModel camera = StreetCameraModel();
    for (uint32_t y = 0; y < depth.height_px; ++y) {
      for (uint32_t x = 0; x < depth.width_px; ++x) {
        const uint16_t code = pixels->codes[size_t{y} * depth.width_px + x];
        known += code != 0;
        const double u = (x + 0.5) * camera.width_px / depth.width_px,
                     v = (y + 0.5) * camera.height_px / depth.height_px;
        const bool is_inside =
            u > area.x && u < area.x + area.width && v > area.y && v < area.y + area.height;
        EXPECT_TRUE(!is_inside || code == 0) << depth.image.value << ": " << x << ", " << y;
      }
    }
    return true;
  }));
  EXPECT_GE(maps, 4u);
  EXPECT_GT(known, maps * 1000) << "the rest has depth";
}

}  // namespace
}  // namespace veduta
