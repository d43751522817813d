// SPDX-License-Identifier: Apache-2.0
#pragma once
// Cameras that another program calibrated, in OpenCV's model, converted to ours.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/camera/calibration/distortion_inversion.h"
#include "storage/base/status.h"
#include "storage/model/camera.h"
#include "storage/model/image_size.h"

namespace veduta {

// The centre of the top-left pixel is (0, 0). The coefficients are in OpenCV's order,
// k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4; those that are not given are 0. There are at most 12, for
// tilted sensors are not supported.
struct KnownCamera {
  ImageSize size;
  double fx = 0, fy = 0, cx = 0, cy = 0;
  std::vector<double> coefficients;
};

struct ConvertedCamera {
  CameraModel model;            // CheckCamera accepts it
  ConversionResidual residual;  // between the two models, over the photo
};

// Keeps fx, fy, cx, cy; k1, k2, u0, v0 minimise the squared distance in px between where the two
// models see the rays that reach the photo. Exact where the coefficients are k1 and k2 alone; a
// small tangential distortion is what a centre of its own does, to first order. kInvalidArgument if
// a value is no number, CheckCamera refuses the result, or the models differ by more than 1/200 of
// the longer side somewhere. Deterministic; about 10 ms.
Result<ConvertedCamera> ConvertCamera(const KnownCamera& known);

// A camera of COLMAP's cameras.txt.
struct KnownColmapCamera {
  uint32_t id = 0;
  std::string model;
  KnownCamera camera;
};

// From what COLMAP's files say of it: SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL, RADIAL or OPENCV, and
// its parameters in COLMAP's order. COLMAP's centre of the top-left pixel, (0.5, 0.5), becomes
// ours. kInvalidArgument says what is wrong.
Result<KnownColmapCamera> MakeColmapCamera(uint32_t id, std::string_view model, double width_px,
                                           double height_px, std::span<const double> parameters);

// All cameras of the text of a cameras.txt, in its order. kInvalidArgument names line and
// fault.
Result<std::vector<KnownColmapCamera>> ParseColmapCameras(std::string_view text);

// The camera in the text of a file that OpenCV's FileStorage wrote (YAML, XML or JSON):
// image_width, image_height, camera_matrix, distortion_coefficients. kInvalidArgument names what is
// missing or wrong.
Result<KnownCamera> ParseOpenCvCamera(const std::string& text);

}  // namespace veduta
