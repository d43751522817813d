// SPDX-License-Identifier: Apache-2.0
#pragma once
// What is told of an upload to one who may not see all photos.

#include "cli/service/photo_intake.h"
#include "engine/engine.h"

namespace veduta {

// The news without what may not be told to whoever asks by `ask`: of which photo the bytes are
// stored. kNotFound where nothing may be told, since the photo, or its contribution, is hidden.
Result<UploadNews> ToldOf(const Questions& ask, UploadNews news);

}  // namespace veduta
