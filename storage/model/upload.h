// SPDX-License-Identifier: Apache-2.0
#pragma once
// A photo that was taken from somebody and waits on the disk for its turn.

#include <cstdint>
#include <string>

#include "storage/base/content_hash.h"

namespace veduta {

struct UploadRecord {
  uint64_t number = 0;  // from 1, in the order in which they came; no other one ever has it
  std::string name, contributor;
  std::string camera;  // its name; empty: it is to be found
  ContentHash photo;
  uint64_t size_bytes = 0;
  int64_t time_unix_s = 0;    // when it came
  uint32_t contribution = 0;  // that it is a part of; 0: of none
};

}  // namespace veduta
