// SPDX-License-Identifier: Apache-2.0
#pragma once
// Names that strangers give to photos, cameras and themselves.

#include <string>

#include "storage/base/status.h"

namespace veduta {

// UTF-8 without control characters, and not too long; kInvalidArgument says what `what` must be.
Status CheckName(const std::string& what, const std::string& name);
// The same of a photo's: it is that of a file, or of its path below a folder, and leads nowhere
// else.
Status CheckPhotoName(const std::string& name);

}  // namespace veduta
