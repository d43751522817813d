// SPDX-License-Identifier: Apache-2.0
// Goal: the camera of a copy sees a point where the copy shows it, however both are turned.
// Method: points through the camera and through the copy's, with distortion.
#include "engine/localization/copied_camera.h"

#include <gtest/gtest.h>

#include "engine/camera/orientation.h"
#include "engine/camera/projection.h"
#include "tests/storage/samples.h"

namespace veduta {
namespace {

// Where the stored pixels show a point before the upright camera.
Eigen::Vector2d PlaceOf(const CameraModel& camera, int orientation,
                        const Eigen::Vector3d& upright) {
  const Eigen::Vector3d x_cam = UprightCamFromStoredCam(orientation).transpose() * upright;
  return DistortPixel(camera, {camera.fx * x_cam.x() / x_cam.z() + camera.cx,
                               camera.fy * x_cam.y() / x_cam.z() + camera.cy});
}

TEST(CopiedCamera, SeesWhatTheCopyShows) {
  const CameraModel camera{1600, 1200, 1400, 1410, 790, 612, -0.08, 0.02, 800, 605};
  const ImageSize size{camera.width_px, camera.height_px};
  for (const int orientation : {0, 1, 3, 6, 8}) {
    for (const int copy_orientation : {0, 1, 3, 6, 8}) {
      const bool is_swapped = (orientation >= 5) != (copy_orientation >= 5);
      const ImageSize copy_size = is_swapped ? ImageSize{600, 800} : ImageSize{800, 600};
      const CameraModel copy = CameraOfCopy(camera, orientation, copy_size, copy_orientation);
      EXPECT_OK(CheckCamera(copy));
      for (const Eigen::Vector3d& point :
           {Eigen::Vector3d(0.3, -0.2, 1), Eigen::Vector3d(-0.35, 0.3, 1.1)}) {
        const Eigen::Vector2d whole = UprightFromStored(PlaceOf(camera, orientation, point), size,
                                                        orientation),
                              half = UprightFromStored(PlaceOf(copy, copy_orientation, point),
                                                       copy_size, copy_orientation);
        EXPECT_LT((half - (0.5 * whole - Eigen::Vector2d(0.25, 0.25))).norm(), 1e-9)
            << orientation << " " << copy_orientation;
      }
    }
  }
}

}  // namespace
}  // namespace veduta
