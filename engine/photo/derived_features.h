// SPDX-License-Identifier: Apache-2.0
#pragma once
// Features that are there in any case: where those that are stored are damaged, they are computed
// again from the photo.

#include "engine/camera/decoder.h"
#include "engine/camera/undistorter.h"
#include "storage/database.h"

namespace veduta {

// The features of a stored image, where its camera's model has them (carried_features.h); the same
// ones, however they are had. Computing them takes about a second, and nothing is stored. The
// failure of reading them where the photo does not give them either. Thread-safe.
Result<Features> ReadOrDeriveFeatures(const Snapshot& snapshot, const ImageRecord& image,
                                      const CameraRecord& camera, UndistortCache* tables,
                                      const PhotoDecoder& decoder = DecoderInProcess());
// The same with the camera from the snapshot, and with a table that is built for this photo alone.
Result<Features> ReadOrDeriveFeatures(const Snapshot& snapshot, const ImageRecord& image,
                                      const PhotoDecoder& decoder = DecoderInProcess());

}  // namespace veduta
