// SPDX-License-Identifier: Apache-2.0
#pragma once
// The inner loops of the matchers, as kernels of one isa each (storage/base/cpu_isa.h), and the
// layout that they share. Files built with wider vectors include this: there is nothing but plain
// structs here, for an inline function compiled there could be called on a processor without them.

#include <cstddef>
#include <cstdint>

namespace veduta {

enum class CpuIsa : uint8_t;  // storage/base/cpu_isa.h

inline constexpr int kPanelColumns = 16;  // descriptors side by side in a panel
inline constexpr int kPanelGroups = 32;   // groups of 4 bytes in a descriptor

// An empty column's |x|^2. Above anything real (128 * 255^2 = 8'323'200), even, and still 24 bits
// with its sign.
inline constexpr int32_t kPaddingNorm = 8'388'606;

// Sixteen descriptors interleaved by groups of four bytes, as the byte dot products of vector units
// want them. Empty columns hold zero bytes, kPaddingNorm and a sum of zero.
struct alignas(64) DescriptorPanel {
  uint8_t bytes[kPanelGroups][kPanelColumns][4];
  int32_t norms_squared[kPanelColumns];
  int32_t sums[kPanelColumns];  // of a descriptor's bytes
};
static_assert(sizeof(DescriptorPanel) == 2176);

// The descriptors that may match each other: one contrast sign of one image.
struct PanelSpan {
  const DescriptorPanel* panels;  // ceil(count / 16)
  uint32_t count;
};

inline constexpr uint32_t kNoMatch = UINT32_MAX;

// Where a descriptor's nearest neighbors in the other set are. All fields are kNoMatch where there
// is none.
struct NearestPair {
  uint32_t best;             // ordinal in the other set; the lowest of equals
  uint32_t distance;         // squared
  uint32_t second_distance;  // squared, of the nearest other than `best`
};
struct Nearest {
  uint32_t best;
  uint32_t distance;
};

struct MatcherKernels {
  // The two nearest columns of every row, and the two nearest rows of every column, in one pass
  // over the products. rows_out[rows.count], columns_out[columns.count]; column_keys is scratch,
  // twice ceil(columns.count / 16) * 16 long. Exact; ties go to the lowest ordinal.
  void (*nearest_both_ways)(PanelSpan rows, PanelSpan columns, NearestPair* rows_out,
                            NearestPair* columns_out, int32_t* column_keys);

  // distances[i] = squared distance of `query` to descriptor indices[i] of `descriptors`, 128 bytes
  // each, any alignment. Exact.
  void (*distances)(const uint8_t* query, const uint8_t* descriptors, const uint32_t* indices,
                    size_t count, uint32_t* distances);
};

// The kernels written for exactly this isa; null where there are none, or the processor lacks it.
const MatcherKernels* FindMatcherKernels(CpuIsa isa);
// The fastest that this processor can run. Thread-safe; a few nanoseconds.
const MatcherKernels& BestMatcherKernels();

// Each is defined in its own file; the vector ones are null off x86-64.
extern const MatcherKernels* const kMatcherKernelsPortable;
extern const MatcherKernels* const kMatcherKernelsAvx2;
extern const MatcherKernels* const kMatcherKernelsAvx512Vnni;

}  // namespace veduta
