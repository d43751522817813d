// SPDX-License-Identifier: Apache-2.0
#pragma once
// Features of photos whose lens has been refined since they were extracted. What is stored of them
// stays; their places are carried over when they are read.

#include <memory>
#include <span>

#include "engine/photo/photo_preparer.h"
#include "storage/model/camera.h"
#include "storage/model/features.h"

namespace veduta {

// Carries the places of features, undistorted px, from where CameraRecord::extraction_model has
// them to where `model` has them: through the pixel of the photo that both see. Each rounds once,
// so that it does not matter how often the lens was refined. Their scales and angles stay, which
// change by far less than they are known to. Nothing is done where the lens was not refined, or
// where a model is none that CheckCamera accepts. Thread-safe.
void CarryKeypoints(const CameraRecord& camera, std::span<Keypoint> keypoints);
// The same features where nothing is to be carried, else a copy.
std::shared_ptr<const Features> Carried(const CameraRecord& camera,
                                        std::shared_ptr<const Features> extracted);
// PhotoPreparer::Extract as adding the photo with the camera would, its features carried over to
// the camera's model.
PreparedPhoto ExtractCarried(const PhotoPreparer& preparer, const PhotoSource& source,
                             const CameraRecord& camera);

}  // namespace veduta
