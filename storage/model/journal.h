// SPDX-License-Identifier: Apache-2.0
#pragma once
// What was done, by whom.

#include <cstdint>
#include <string>

#include "storage/base/ids.h"

namespace veduta {

struct JournalRecord {
  uint64_t sequence = 0;
  int64_t time_unix_s = 0;
  std::string actor;  // the contributor, or "veduta"
  // add propagate adjust split doubt merge judge hypothesis vocabulary camera densify backup
  // remove replace import forbid allow repair georeference ground token contribution hide unhide
  // report dismiss
  std::string action;
  ImageId image;
  ReconstructionId reconstruction;
  std::string detail;
};

}  // namespace veduta
