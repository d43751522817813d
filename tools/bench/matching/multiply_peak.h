// SPDX-License-Identifier: Apache-2.0
#pragma once
// How many byte products a core multiplies and adds a second at most: loops of nothing else, on
// registers alone.

#include <cstdint>

namespace veduta {

// Each runs `rounds` rounds and returns how many products that was; the caller takes the time. Only
// where the processor has the instructions. Zero where the build lacks them.
uint64_t MultiplyAvx2(uint64_t rounds);        // vpmaddwd and vpaddd, 16 products a pair
uint64_t MultiplyAvx512Vnni(uint64_t rounds);  // vpdpbusd, 64 products

}  // namespace veduta
