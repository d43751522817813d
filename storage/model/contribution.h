// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos that somebody sends together, with what there is to say of all of them.

#include <cstdint>
#include <string>

#include "storage/base/ids.h"
#include "storage/model/verdict.h"

namespace veduta {

struct ContributionRecord {
  uint32_t number = 0;  // from 1; never used again
  std::string contributor, comment, licence;
  int64_t opened_unix_s = 0;
  int64_t closed_unix_s = 0;  // 0: it takes photos
  uint64_t photo_count = 0;   // that were ever taken for it
};

// What became of one of its photos. Values are stored: append only, never renumber.
enum class ContributionFate : uint8_t {
  kWaiting = 1,    // for its turn
  kStored = 2,     // as an image, whose verdict may change
  kDuplicate = 3,  // an image has its bytes
  kNotStored = 4,  // `verdict` and `reason` say why
  kFailed = 5,     // it was not judged
  kRemoved = 6,    // before it had its turn
};

struct ContributedPhoto {
  uint32_t contribution = 0;
  uint64_t upload = 0;  // its number in line
  ContributionFate fate = ContributionFate::kWaiting;
  // The stored one, or the one that has the same bytes. Once it is removed, nothing has its number.
  ImageId image;
  Verdict verdict = Verdict::kPostponed;  // of kNotStored
  Reason reason = Reason::kNone;
  std::string name;  // empty where an image has it, or its bytes, or had
};

}  // namespace veduta
