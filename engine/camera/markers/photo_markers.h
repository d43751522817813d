// SPDX-License-Identifier: Apache-2.0
#pragma once
// From photo files to what a calibration starts from.

#include <functional>
#include <string>
#include <vector>

#include "engine/camera/calibration/observations.h"
#include "engine/camera/markers/detector.h"
#include "engine/camera/photo_decoder.h"
#include "storage/base/thread_pool.h"

namespace veduta {

enum class PhotoUse : uint8_t {
  kUsed,
  kUnreadable,     // no such file, not a photo, or damaged
  kOtherSize,      // not of the size that most photos have: of another camera, cropped, or resized
  kTooFewMarkers,  // fewer than a photo needs to say anything
};

struct PhotoNote {
  std::string name;  // in CalibrationInput
  std::string path;
  PhotoUse use = PhotoUse::kUnreadable;
  std::string detail;               // why not kUsed, for a person; else empty
  uint32_t marker_count = 0;        // found and taken
  std::vector<MarkerId> ambiguous;  // seen twice in this photo and left out
  double blur_px = 0;               // median sigma of the markers' edges
  // The median of the blur over the marker's diameter, which is the root of width times height.
  double blur_share = 0;
  std::string advice;  // how a photo that was used could be better, for a person; may be empty
};

struct PhotoMarkersOptions {
  MarkerOptions markers;
  DecodeLimits decode;
  // >= 1; a photo with fewer markers is not used. A homography fits any 4 points exactly, so that
  // only a fifth can contradict it.
  uint32_t marker_count_min = 5;

  Status Check() const;  // the first violated bound, named with its value
};

struct PhotoMarkers {
  CalibrationInput input;        // of the photos used, in the order given
  std::vector<PhotoNote> notes;  // of every photo, in the order given
  ImageSize size;                // of the photos used
};

// Decodes the photos, each on one thread, and detects their markers. The camera's size is the one
// that most of the photos have. Photos are taken as stored or upright as DecodePhoto takes them for
// a camera of that size, which is how they are taken when they are added to a database. A photo is
// named by its file's name, or by its path where two files have the same
// name. A path that is given twice counts once.
//
// progress  is called with the number of photos done, by one thread at a time; may be empty.
//
// Deterministic in the files and options. kInvalidArgument on bad options, or if there are no
// photos. What is wrong with a single photo is in its note.
Result<PhotoMarkers> DetectInPhotos(const std::vector<std::string>& paths,
                                    const PhotoMarkersOptions& options, ThreadPool* pool,
                                    const std::function<void(size_t)>& progress = nullptr);

}  // namespace veduta
