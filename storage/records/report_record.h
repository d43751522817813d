// SPDX-License-Identifier: Apache-2.0
#pragma once
// What people have reported: entries of family `meta`. FORMAT.md, section "report_record".

#include <string>
#include <string_view>

#include "storage/base/status.h"
#include "storage/model/moderation.h"

namespace veduta {

inline constexpr std::string_view kReportPrefix = "report/";
std::string ReportKey(uint32_t number);
// Fills the number. kCorruption for any other key.
Status ParseReportKey(std::string_view key, ReportRecord* report);

Status Check(const ReportRecord& report);
Result<std::string> Encode(const ReportRecord& report);
// `report` has its number already.
Status Decode(std::string_view value, ReportRecord* report);

}  // namespace veduta
