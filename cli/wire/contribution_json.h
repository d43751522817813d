// SPDX-License-Identifier: Apache-2.0
#pragma once
// The JSON shapes of contributions, and of photos that arrive in parts. docs/serving.md lists the
// keys.

#include "cli/wire/json.h"
#include "engine/engine.h"

namespace veduta {

Json ToJson(const PartialUploadAnswer& partial);
Json ToJson(const ContributionAnswer& contribution);
Json ToJson(const ContributionSums& sums);
Json ToJson(const ContributedPhotoAnswer& photo);

}  // namespace veduta
