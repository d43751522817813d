// SPDX-License-Identifier: Apache-2.0
#pragma once
// A photo that arrives in parts, over as many connections as it takes.

#include <array>
#include <cstdint>
#include <string>

namespace veduta {

using PartialUploadId = std::array<uint8_t, 16>;  // drawn at random, so that nobody guesses one

struct PartialUploadRecord {
  PartialUploadId id{};
  std::string name, contributor;
  std::string camera;         // its name; empty: it is to be found
  uint32_t contribution = 0;  // that it is a part of; 0: of none
  uint32_t token = 0;         // the number of the token that sends it; 0: none
  uint64_t length_bytes = 0;  // of the whole photo, at least 1
  uint64_t received_bytes = 0;
  // How its bytes lie: pieces from 0 on, of which the last one may still grow. None once it is in
  // line.
  uint32_t piece_count = 0;
  uint64_t last_piece_bytes = 0;
  int64_t begun_unix_s = 0;
  int64_t touched_unix_s = 0;  // when bytes came last
  uint64_t upload = 0;         // its number in line, once all bytes have come; 0 before
};

}  // namespace veduta
