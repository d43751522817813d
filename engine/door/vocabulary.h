// SPDX-License-Identifier: Apache-2.0
#pragma once
// The shape of a vocabulary that a person asks for.

#include <cstdint>

namespace veduta {

// The defaults are the shape of a vocabulary that the database trains by itself: ten children for
// each node and up to seven levels, from two million descriptors at most, as R8 of docs/paper.md
// says.
struct VocabularyRequest {
  uint32_t branch = 10;  // [2, 64]: children of a node at most
  uint32_t levels = 7;   // [1, 7]: levels of centers below the root
  // 0, or [1000, 16777216]: descriptors that it is trained on, drawn from all photos; all of them
  // where there are fewer. 0: as many as the database takes by itself.
  uint32_t sample = 0;
};

}  // namespace veduta
