// SPDX-License-Identifier: Apache-2.0
#pragma once
// Cameras from their photos of any place: what a city begins with whose cameras nobody has
// calibrated.

#include <cstdint>
#include <memory>
#include <span>
#include <stop_token>
#include <vector>

#include "engine/camera/calibration/calibration_result.h"
#include "engine/camera/decoder.h"
#include "engine/door/submission.h"
#include "engine/matching/focal_scan.h"

namespace veduta {

struct SceneCalibrationOptions {
  // >= 4. Photos that are used, the first ones. More say little more. Chosen by hand.
  uint32_t photos_max = 40;
  // >= 2. Photos among which a first focal length is sought, and the pairs of them with most
  // matches. Chosen by hand.
  uint32_t scanned_photos_max = 12, scanned_pairs_max = 15;
  // >= 1. Focal lengths of the scan with which a reconstruction is tried, the best first, until one
  // holds enough images. Chosen by hand.
  uint32_t starts_max = 3;
  // >= 4, images of a reconstruction that may say what the camera is.
  uint32_t images_min = 4;
  // >= 1. Reconstructions that are made, each with the camera that the one before has given; fewer
  // where the focal length has come to rest, to `rest_share` of itself. Chosen by hand.
  uint32_t rounds_max = 5;
  double rest_share = 0.001;
  // >= 100. Points that are adjusted, those that most photos see. Chosen by hand.
  uint32_t points_max = 3000;
  FocalScanOptions scan;
  // >= 0, of the cameras: the focal lengths over their photos' longer sides that the photos tell; 0
  // where they tell nothing. May be shorter than there are cameras. They are tried first, and mean
  // no more than that.
  std::vector<double> told_focal_shares;
  std::shared_ptr<const PhotoDecoder> decoder;  // null: the calling threads decode

  Status Check() const;  // the first violated bound, named with its value
};

// Scans focal lengths by pairs of the photos (focal_scan.h), makes a city of its own of them in the
// system's folder for temporary files, adjusts its poses, points and the lens together
// (plane_adjustment.h without a plane), and begins anew with that lens until it rests. Pixels are
// square; the principal point is thought to lie near the photo's middle.
//
// All photos must have one size. Photos that cannot be read or placed are left out, with a note.
// kInvalidArgument, with what to photograph, where too few photos can be placed or they leave the
// focal length open; kIoError where the temporary folder cannot be written; kCancelled after a stop
// request. Deterministic, whatever the number of threads. O(rounds * adding the photos).
Result<Calibration> CalibrateByScene(std::span<const PhotoSource> photos, uint32_t thread_count,
                                     std::stop_token stop = {},
                                     const SceneCalibrationOptions& options = {});

// The same where several cameras took the photos: `cameras` says of each photo the number of the
// one that took it; numbers begin at 0, and each comes up first after all that are smaller. All
// photos of one camera must have one size. Gives for each camera of the first photos_max photos its
// calibration, or why there is none. Nothing is scanned: reconstructions are tried with the focal
// lengths that are told, those of the others like their median, and with a few that are the same
// for all cameras, over their photos' longer sides.
Result<std::vector<Result<Calibration>>> CalibrateCamerasByScene(
    std::span<const PhotoSource> photos, std::span<const uint32_t> cameras, uint32_t thread_count,
    std::stop_token stop = {}, const SceneCalibrationOptions& options = {});

}  // namespace veduta
