// SPDX-License-Identifier: Apache-2.0
#pragma once
// Whether a prepared photo is new to the database: the answers that need no look at the photo's
// content.

#include <string>

#include "engine/photo/photo_preparer.h"
#include "storage/database.h"

namespace veduta {

enum class AdmissionOutcome : uint8_t {
  kNew,        // to be placed
  kDuplicate,  // the same bytes are stored
  kNameTaken,  // another photo of this contributor is stored under this name
  kRejected,   // preparation found a reason to reject it
  kOutdated,   // the same bytes were stored when it was prepared, and were removed since
};

struct Admission {
  AdmissionOutcome outcome = AdmissionOutcome::kNew;
  ImageRecord stored;  // kDuplicate: the image with these bytes
  // Of all others but kDuplicate: the record to store, without a verdict. Its id is valid() where
  // it replaces a rejected photo of the same name, which may be sent again once it is mended.
  ImageRecord record;
  bool is_prepared = false;  // it has features, and what was written ahead of it is there
};

// Reads the snapshot only.
Result<Admission> Admit(const Snapshot& snapshot, const PreparedPhoto& photo, CameraId camera,
                        const std::string& contributor);

}  // namespace veduta
