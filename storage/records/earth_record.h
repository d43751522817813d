// SPDX-License-Identifier: Apache-2.0
#pragma once
// What records tell of the earth: parts of image and reconstruction records, and surveyed points,
// which are entries of family `meta`. FORMAT.md, section "earth_record".

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/earth.h"
#include "storage/records/schema.capnp.h"

namespace veduta {

Status Check(const GpsFix& fix);
void Fill(schema::Gps::Builder to, const GpsFix& fix);
GpsFix Read(schema::Gps::Reader from);

Status Check(const Georeference& georeference);
void Fill(schema::Georeference::Builder to, const Georeference& georeference);
Status Read(schema::Georeference::Reader from, Georeference* georeference);

inline constexpr std::string_view kGroundPointPrefix = "ground/";
std::string GroundPointKey(std::string_view name);
// Fills the name. kCorruption for any other key.
Status ParseGroundPointKey(std::string_view key, GroundPoint* point);

Status Check(const GroundPoint& point);
Result<std::string> Encode(const GroundPoint& point);
// `point` has its name already.
Status Decode(std::string_view value, GroundPoint* point);

}  // namespace veduta
