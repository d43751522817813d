// SPDX-License-Identifier: Apache-2.0
#pragma once
// Sort keys of the vector kernels: 24 bits of (partial) squared distance over 8 bits of where it
// was found. The smallest key is the nearest neighbor, the lowest index first among equals. Only
// kernel files include this. Every function is static, so that no processor ever calls one that was
// compiled for wider vectors than it has.

#include "engine/matching/matcher_kernels.h"

namespace veduta {

constexpr int kKeyBits = 8;
constexpr uint32_t kRowsPerBlock = 1u << kKeyBits;  // a column's key names the row within a block
constexpr uint32_t kGroupsPerBlock =
    1u << kKeyBits;  // a row's key names the group of columns, its lane the column
constexpr int32_t kPaddingKey =
    kPaddingNorm * (1 << kKeyBits);  // keys of padding columns are no smaller, real ones are

// Joins the best columns of one block with what a row had before, from lower columns, or the best
// rows of one block with what a column had.
static inline void MergeNearest(uint32_t best, uint32_t distance, uint32_t second_distance,
                                NearestPair* nearest) {
  if (distance < nearest->distance) {
    nearest->second_distance =
        second_distance < nearest->distance ? second_distance : nearest->distance;
    nearest->distance = distance;
    nearest->best = best;
  } else if (distance < nearest->second_distance) {
    nearest->second_distance = distance;
  }
}

// Where the columns' second smallest keys begin, behind the smallest ones.
static inline uint32_t PaddedCount(PanelSpan columns) {
  return (columns.count + kPanelColumns - 1) / kPanelColumns * kPanelColumns;
}

// Joins the columns' keys over one block of rows with what the columns had before, from lower rows.
// `missing` masks the part of the column's own norm that its keys lack.
static inline void MergeColumns(PanelSpan columns, uint32_t first_row, const int32_t* column_keys,
                                int32_t missing, NearestPair* columns_out) {
  const int32_t* const seconds = column_keys + PaddedCount(columns);
  for (uint32_t c = 0; c < columns.count; ++c) {
    const int32_t rest =
        columns.panels[c / kPanelColumns].norms_squared[c % kPanelColumns] & missing;
    MergeNearest(first_row + static_cast<uint32_t>(column_keys[c] & (kRowsPerBlock - 1)),
                 static_cast<uint32_t>((column_keys[c] >> kKeyBits) + rest),
                 seconds[c] >= kPaddingKey ? kNoMatch
                                           : static_cast<uint32_t>((seconds[c] >> kKeyBits) + rest),
                 &columns_out[c]);
  }
}

static inline void ClearNearest(PanelSpan rows, PanelSpan columns, NearestPair* rows_out,
                                NearestPair* columns_out) {
  for (uint32_t r = 0; r < rows.count; ++r) rows_out[r] = {kNoMatch, kNoMatch, kNoMatch};
  for (uint32_t c = 0; c < columns.count; ++c) columns_out[c] = {kNoMatch, kNoMatch, kNoMatch};
}

static inline void ClearKeys(PanelSpan columns, int32_t* column_keys) {
  const uint32_t count = 2 * PaddedCount(columns);
  for (uint32_t c = 0; c < count; ++c) column_keys[c] = INT32_MAX;
}

}  // namespace veduta
