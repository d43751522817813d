// SPDX-License-Identifier: Apache-2.0
#pragma once
// How a database is opened.

#include <cstdint>
#include <string>

#include "storage/base/status.h"

namespace veduta {

// What becomes of a photo that is a stored one once more, resized or encoded anew.
enum class Doubles : uint8_t {
  kKeep,    // nobody looks for that: it is stored as any other
  kRefuse,  // it is answered as a duplicate of the stored one, and not stored
  kBetter,  // the same, but one of more pixels takes the place of the stored one's bytes
};

struct EngineOptions {
  bool create = false;        // make a new database; kAlreadyExists if one is there
  bool read_only = false;     // takes no lock, writes nothing; sees the last commit at opening
  bool sync = true;           // false: a power cut may lose the last photos (a crash does not)
  bool settle_each = false;   // Submit does as AddPhotos, so that the same order gives one digest
  uint32_t thread_count = 0;  // [0, 1024]; 0: one per core
  uint64_t block_cache_bytes = 256ull << 20;      // >= 1; of the database's files
  uint64_t feature_cache_bytes = 768ull << 20;    // >= 1; of images' features
  uint64_t undistort_cache_bytes = 256ull << 20;  // >= 1; of cameras' lookup tables
  // >= 3; of surfaces: a third for coarse parts of them, the rest for what the dense pass keeps.
  uint64_t surface_cache_bytes = 768ull << 20;
  // Memory for photos that are decoded and whose features are extracted at the same time, on
  // however many threads; a photo that needs more (about 40 bytes for each of its pixels up to 33
  // Mpx, 16 beyond) is prepared alone. The dense pass takes what it decodes, and what a depth map
  // needs, from the same. 0: half of what the first three caches leave of the memory that the
  // process may use, at least 256 MiB. Changes no photo's verdict.
  uint64_t prepare_memory_bytes = 0;
  // The path of `veduta-decoder`, which has each photo decoded in a process of its own that can do
  // nothing else: for photos of strangers. Empty: the engine's threads decode them. Changes no
  // photo's verdict, but where decoding would end the program. Opening fails (kIoError) where the
  // system cannot shut processes in.
  std::string decoder_program = {};

  Doubles doubles = Doubles::kKeep;
  // The path of a program that tells which areas of a photo are private, such as faces
  // (engine/photo/blur_command.h). They are filled before the photo is stored, and what came is
  // sealed. A photo that the program says nothing of is not stored. Empty: nobody is asked.
  std::string blur_command = {};

  Status Check() const;  // the first violated bound, named with its value
};

}  // namespace veduta
