// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a repair is asked, and what it answers.

#include <cstdint>
#include <string>
#include <vector>

#include "storage/base/status.h"

namespace veduta {

struct RepairRequest {
  bool apply = false;         // false: nothing is changed, and the answer says what would be done
  uint32_t thread_count = 0;  // [0, 1024]; 0: one per core
  // Whether the map may be made anew from the photos, with new numbers for the images, where
  // nothing less gives a sound database.
  bool may_rebuild = false;

  Status Check() const;  // the first violated bound, named with its value
};

// One damage, and what a repair does about it. Both are clauses for people.
struct RepairFinding {
  std::string damage, remedy;
};

struct RepairAnswer {
  bool is_sound = false;     // nothing is damaged, and nothing was done
  bool is_repaired = false;  // the database at the path is the new one, and sound
  std::vector<RepairFinding> findings;
  std::vector<std::string> lost;         // names of photos whose bytes are gone
  std::vector<std::string> retried;      // names of photos that lost their place
  std::vector<std::string> written_out;  // names of photos to be added again, with their camera
  bool is_rebuilt = false;               // the map was made anew from the photos
  std::string kept_path;                 // where the damaged database is kept
  std::string report_path;               // a text file with everything that is said here
  std::string photos_path;               // the folder of `written_out`; empty where there are none
};

}  // namespace veduta
