// SPDX-License-Identifier: Apache-2.0
#pragma once
// What curators hide, what people report, and what tokens have used of their quotas. None of it is
// a part of the city, or of its digest.

#include <cstdint>
#include <optional>
#include <vector>

#include "storage/base/status.h"
#include "storage/model/moderation.h"
#include "storage/model/token.h"

namespace veduta {

class ModerationReader {
 public:
  virtual ~ModerationReader() = default;

  virtual Result<std::vector<HiddenRecord>> ListHidden() const = 0;  // ascending kinds, numbers
  // Whether there is this fact: an image may be hidden by its contribution's as well. One read.
  virtual Result<bool> IsHidden(HiddenKind kind, uint32_t number) const = 0;
  virtual Result<std::vector<ReportRecord>> ListReports() const = 0;  // ascending numbers
  virtual Result<std::optional<ReportRecord>> FindReport(uint32_t number) const = 0;
  virtual Result<std::vector<TokenUse>> ListTokenUse() const = 0;  // ascending numbers
};

}  // namespace veduta
