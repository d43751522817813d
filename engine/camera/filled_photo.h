// SPDX-License-Identifier: Apache-2.0
#pragma once
// A photo without its private areas, as it is stored.

#include <cstdint>
#include <opencv2/core.hpp>
#include <span>
#include <vector>

#include "engine/camera/decoder.h"
#include "engine/camera/private_areas.h"
#include "storage/base/status.h"

namespace veduta {

// A JPEG of the picture (CV_8UC3, blue first, not empty), of quality 95 without subsampled colours:
// the same bytes on every processor. kIoError where the encoder fails.
Result<std::vector<uint8_t>> EncodePicture(const cv::Mat& bgr);

// A JPEG of the photo, stored as it was turned, in which the areas are filled with grey, and which
// names them (private_areas.h). Of what came with the photo it has what Examine read of it: no
// small picture, no notes of the maker. `upright` is the photo decoded; it is filled, too. Areas,
// of which there is one at least, are of the upright photo and lie within it. kIoError.
Result<std::vector<uint8_t>> FillPhoto(cv::Mat upright, const PhotoExamination& examined,
                                       std::span<const PixelArea> areas);

}  // namespace veduta
