// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a person forbids, or allows again, as one transaction each.

#include <string>

#include "engine/ingest/ingest_parts.h"
#include "engine/ingest/write_scope.h"
#include "storage/model/forbidden.h"

namespace veduta {

// Stores that these two (images with features, or living reconstructions; kPair or kMerge) are
// forbidden, with an entry in the journal. A verified pair that there is goes with its matches, and
// where both have poses in one reconstruction, its adjustment is due, which judges it anew. Nothing
// where they are forbidden already. kNotFound; kInvalidArgument where the two are one.
Status Forbid(ForbiddenRecord forbidden, WriteScope scope);

// What the record of an image says while its pose is forbidden.
inline constexpr const char* kPoseForbiddenDetail = "it is tried again once that is allowed";

// Stores that the image has no pose until that is allowed again, with an entry in the journal. A
// pose that it has goes: points lose its views, images that too few points hold without it wait and
// are tried again, what the dense pass has made of these images goes, and the adjustment of the
// reconstruction is due. Nothing where it is forbidden already. kNotFound; kInvalidArgument for a
// rejected photo. After an error nothing is committed and the map may be half changed: the caller
// clears it. O(what is around the image).
Status ForbidPose(const IngestParts& parts, ImageId image, const std::string& actor,
                  const std::string& reason, WriteScope scope);

// Allows again what was forbidden. For kPose both ids are those of the image, which the next step
// tries to place again. kNotFound where it was not forbidden.
Status Allow(ForbiddenKind kind, uint32_t a, uint32_t b, const std::string& actor,
             const std::string& reason, WriteScope scope);

}  // namespace veduta
