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

// Joins the best columns of one block with what the row had before, from lower columns.
static inline void MergeIntoRow(uint32_t column, uint32_t distance, uint32_t second_distance,
                                NearestPair* row) {
  if (distance < row->distance) {
    row->second_distance = second_distance < row->distance ? second_distance : row->distance;
    row->distance = distance;
    row->best = column;
  } else if (distance < row->second_distance) {
    row->second_distance = distance;
  }
}

// Joins the columns' keys over one block of rows with what the columns had before, from lower rows.
// `missing` masks the part of the column's own norm that its keys lack.
static inline void MergeColumns(PanelSpan columns, uint32_t first_row, const int32_t* column_keys,
                                int32_t missing, Nearest* columns_out) {
  for (uint32_t c = 0; c < columns.count; ++c) {
    const int32_t rest =
        columns.panels[c / kPanelColumns].norms_squared[c % kPanelColumns] & missing;
    const uint32_t distance = static_cast<uint32_t>((column_keys[c] >> kKeyBits) + rest);
    if (distance < columns_out[c].distance) {
      columns_out[c] = {first_row + static_cast<uint32_t>(column_keys[c] & (kRowsPerBlock - 1)),
                        distance};
    }
  }
}

static inline void ClearNearest(PanelSpan rows, PanelSpan columns, NearestPair* rows_out,
                                Nearest* columns_out) {
  for (uint32_t r = 0; r < rows.count; ++r) rows_out[r] = {kNoMatch, kNoMatch, kNoMatch};
  for (uint32_t c = 0; c < columns.count; ++c) columns_out[c] = {kNoMatch, kNoMatch};
}

static inline void ClearKeys(PanelSpan columns, int32_t* column_keys) {
  const uint32_t padded = (columns.count + kPanelColumns - 1) / kPanelColumns * kPanelColumns;
  for (uint32_t c = 0; c < padded; ++c) column_keys[c] = INT32_MAX;
}

}  // namespace veduta
