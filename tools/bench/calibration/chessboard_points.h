// SPDX-License-Identifier: Apache-2.0
#pragma once
// The corners of a chessboard in a photo, by OpenCV.

#include <opencv2/core.hpp>
#include <string>

#include "engine/camera/calibration/observations.h"

namespace veduta {

// board: inner corners across and down. Inner corner (column, row) is the point of id row *
// board.width + column; a board that looks the same upside down may come out either way round.
// False if the photo cannot be read or shows no board.
bool FindChessboard(const std::string& path, cv::Size board, ViewObservations* view);

}  // namespace veduta
