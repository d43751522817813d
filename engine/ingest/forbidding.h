// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a person forbids, or allows again, as one transaction each.

#include <string>

#include "engine/ingest/write_scope.h"
#include "storage/model/forbidden.h"

namespace veduta {

// Stores that these two (images with features, or living reconstructions) are forbidden, with an
// entry in the journal. A verified pair that there is goes with its matches, and where both have
// poses in one reconstruction, its adjustment is due, which judges it anew. Nothing where they are
// forbidden already. kNotFound; kInvalidArgument where the two are one.
Status Forbid(ForbiddenRecord forbidden, WriteScope scope);

// Takes it back. kNotFound where it was not forbidden.
Status Allow(ForbiddenKind kind, uint32_t a, uint32_t b, const std::string& actor,
             const std::string& reason, WriteScope scope);

}  // namespace veduta
