// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos that arrive in parts, and contributions: photos that somebody sends together, with what
// there is to say of all of them.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "storage/base/ids.h"
#include "storage/base/status.h"
#include "storage/model/verdict.h"

namespace veduta {

// The photo that is to come.
struct PartialUploadRequest {
  std::string name, contributor;
  std::string camera;         // its name; empty: it is to be found
  uint32_t contribution = 0;  // that it is to be a part of; 0: of none
  uint32_t token = 0;         // the number of the token that sends it; 0: none
  uint64_t length_bytes = 0;  // at least 1, and at most what a photo may have
};

// What may be on its way at the same time, by the lengths that were announced. Those who send are
// told apart by their tokens, where they have one, otherwise by their names as contributors. Chosen
// by hand.
struct PartialUploadLimits {
  uint32_t count_max = 10'000;  // in all, 1 to 1,000,000
  uint64_t bytes_max = 16ull << 30;
  uint32_t count_each_max = 1'000;  // of one who sends
  uint64_t bytes_each_max = 4ull << 30;

  Status Check() const;  // the first violated bound, named with its value
};

// A photo that arrives in parts.
struct PartialUploadAnswer {
  std::string id;  // 32 hexadecimal digits, which nobody guesses
  std::string name, contributor, camera;
  uint32_t contribution = 0, token = 0;
  uint64_t length_bytes = 0;
  uint64_t received_bytes = 0;  // that are on the disk
  int64_t begun_unix_s = 0, touched_unix_s = 0;
  uint64_t upload = 0;     // its number in line, once all bytes have come; 0 before
  bool is_in_line = true;  // false: it is on the disk, and gets in line by Engine::Resume
};

struct ContributionRequest {
  std::string contributor;
  std::string comment;  // UTF-8, at most 2000 bytes; without control characters but line feeds
  std::string licence;  // UTF-8, at most 200 bytes; without control characters
  std::string actor;    // who opens it, for the journal

  Status Check() const;  // the first violated bound, named with its value
};

struct ContributionAnswer {
  uint32_t number = 0;
  std::string contributor, comment, licence;
  int64_t opened_unix_s = 0, closed_unix_s = 0;  // 0: it takes photos
  uint64_t photos = 0;                           // that were ever taken for it
  bool is_hidden = false;  // a curator has hidden it; told to those alone who see it
};

// Its photos in sum, as their verdicts are now.
struct ContributionSums {
  uint64_t arriving = 0;    // in parts
  uint64_t waiting = 0;     // for their turn
  uint64_t placed = 0;      // those that were merged or founded, too
  uint64_t postponed = 0;   // until other photos help
  uint64_t refused = 0;     // of no use, or not stored
  uint64_t duplicates = 0;  // their bytes were there
  uint64_t failed = 0;      // not judged: they may be sent again
  uint64_t removed = 0;
  std::map<Reason, uint64_t> reasons;  // of those postponed or refused
};

struct ContributedPhotoAnswer {
  uint64_t upload = 0;
  std::string name;  // that of the image, where there is one; empty where it was removed
  // waiting, placed, merged, founded, postponed, rejected, duplicate, failed, removed, or hidden:
  // then neither name nor image is told.
  std::string state;
  ImageId image;  // valid where it is stored, or where an image has its bytes
  Reason reason = Reason::kNone;
};

}  // namespace veduta
