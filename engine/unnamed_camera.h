// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which camera took a photo that is added without one.

#include <optional>

#include "engine/parts.h"

namespace veduta {

// The camera that is known already: that of the same bytes where they are stored, or where a camera
// awaits them (CameraRecord), otherwise that of the photos which say that the same camera took them
// (CameraGroupOf). Decodes nothing. kIoError where the file cannot be read. O(cameras).
Result<std::optional<CameraRecord>> FindUnnamedCamera(EngineParts* parts, const PhotoSource& photo);
// The same of a photo that was looked at.
Result<std::optional<CameraRecord>> FindUnnamedCamera(EngineParts* parts, const PhotoFacts& facts);

// Otherwise, of a copy of a stored photo, it is that one's, as much smaller (FindCopiedCamera); of
// a photo that does not say which camera took it, it is one that such photos of its size have told
// together, where that explains it; or it is estimated from where the photo fits into the city
// (LocalizeUnknown), to be stored with the photo: under the group's name where the focal length is
// known to half a percent, so that the group's later photos have it, too; otherwise without a name.
// Where there is no camera the outcome says why: a photo that cannot be read, say, is rejected and
// not stored, and one that fits nowhere yet has a `failure` of kNotFound. Writes nothing.
// Deterministic in the photo and the last commit.
Result<EstimatedUnnamed> EstimateUnnamedCamera(EngineParts* parts, const PhotoSource& photo);

}  // namespace veduta
