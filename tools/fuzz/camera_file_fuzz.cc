// SPDX-License-Identifier: Apache-2.0
// ParseCameraFile on what `veduta calibrate`, COLMAP and OpenCV write.
#include "engine/camera/calibration/calibrator.h"
#include "engine/camera/files/camera_file.h"
#include "engine/camera/projection.h"
#include "tools/fuzz/fuzz_target.h"

namespace veduta::fuzz {

std::vector<std::string> Seeds() {
  return {
      "{\"format\":\"veduta camera\",\"version\":1,\"width\":1536,\"height\":1024,\"intrinsics\":{"
      "\"fx\":1379.7,\"fy\":1382,\"cx\":760,\"cy\":503,\"k1\":0.01,\"k2\":0,\"u0\":760,\"v0\":503},"
      "\"standard_deviations\":{\"fx\":0.2},\"calibration\":{\"from\":\"9 photos\",\"photos_used\":"
      "9,\"error_px_mean\":0.2,\"warnings\":[\"few\"]}}",
      "# Camera list with one line of data per camera:\n1 OPENCV 1536 1024 1379 1382 760 503 0.01 "
      "-0.02 0 0\n2 SIMPLE_RADIAL 640 480 500 320 240 0.1\n",
      "3 FULL_OPENCV 640 480 500 500 320 240 0.1 0 0 0 0 0 0 0\n",
      "4 OPENCV_FISHEYE 640 480 500 500 320 240 0.1 0 0 0\n",
      "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n   "
      "rows: 3\n   cols: 3\n   dt: d\n   data: [ 500., 0., 320., 0., 500., 240., 0., 0., 1. ]\n"
      "distortion_coefficients: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n   data: [ 0.1, "
      "0., 0., 0., 0. ]\n",
      "<?xml version=\"1.0\"?>\n<opencv_storage>\n<image_width>640</image_width>\n<image_height>480"
      "</image_height>\n<camera_matrix type_id=\"opencv-matrix\">\n<rows>3</rows>\n<cols>3</cols>\n"
      "<dt>d</dt>\n<data>500. 0. 320. 0. 500. 240. 0. 0. 1.</data></camera_matrix>\n"
      "</opencv_storage>\n"};
}

}  // namespace veduta::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string text(veduta::fuzz::Text(data, size));
  for (const std::optional<uint32_t> id : {std::optional<uint32_t>(), std::optional<uint32_t>(2)}) {
    const auto camera = veduta::ParseCameraFile(text, id);
    if (camera.ok())
      veduta::fuzz::Expect(veduta::CheckCamera(camera->model), "a camera that is read is accepted");
  }
  return 0;
}
