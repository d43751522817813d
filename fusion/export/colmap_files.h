// SPDX-License-Identifier: Apache-2.0
#pragma once
// The three files of a COLMAP model, written piece by piece, as text or binary: cameras, images,
// points3D (https://colmap.github.io/format.html).

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "storage/base/ids.h"
#include "storage/base/status.h"
#include "storage/base/transform.h"
#include "storage/model/points.h"

namespace veduta {

enum class ColmapCameraModel : int32_t { kPinhole = 1, kOpenCv = 4 };  // COLMAP's numbers

// Pixels are COLMAP's: (0.5, 0.5) is the centre of the top-left pixel.
struct ColmapCamera {
  CameraId id;
  ColmapCameraModel model = ColmapCameraModel::kPinhole;
  uint64_t width_px = 0, height_px = 0;
  std::vector<double> params;  // fx, fy, cx, cy; of kOpenCv also k1, k2, p1, p2
};

struct ColmapFeature {
  double x_px = 0, y_px = 0;
  uint64_t point = 0;  // its number; 0: it sees none
};

struct ColmapImage {
  ImageId id;
  CameraId camera;
  std::string name;
  Rigid3 cam_from_world;
  std::vector<ColmapFeature> features;
};

// Numbers of points begin at 1. An error names the path; kIoError.
class ColmapFiles {
 public:
  virtual ~ColmapFiles() = default;
  virtual void AddCamera(const ColmapCamera& camera) = 0;
  virtual void AddImage(const ColmapImage& image) = 0;
  virtual void AddPoint(uint64_t number, const PointRecord& point) = 0;
  // Closes the files; to be called once, at the end. The first thing that could not be written.
  virtual Status Finish() = 0;
};

// cameras.txt, images.txt and points3D.txt. COLMAP reads a name up to the first space, or the end
// of the line (src/colmap/scene/reconstruction_io_text.cc). So a space, a control character, and a
// % that would be taken for an escape, are written as in a URL (RFC 3986, section 2.1).
Result<std::unique_ptr<ColmapFiles>> OpenColmapText(const std::string& folder);

// cameras.bin, images.bin and points3D.bin, little-endian. Names stand there as they are, up to
// their first zero byte, which no file's name has.
Result<std::unique_ptr<ColmapFiles>> OpenColmapBinary(const std::string& folder);

}  // namespace veduta
