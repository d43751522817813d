// SPDX-License-Identifier: Apache-2.0
// The matcher's kernels in plain C++: what the vector ones must equal.
#include "engine/matching/matcher_kernels.h"

namespace veduta {
namespace {

// products[r][c] = descriptor r of `rows` . descriptor c of `columns`.
void MultiplyPanels(const DescriptorPanel& rows, const DescriptorPanel& columns, uint32_t row_count,
                    int32_t (*products)[kPanelColumns]) {
  // Widened once and laid out by byte, so that the inner loop runs over neighbouring columns.
  int16_t wide[kPanelGroups * 4][kPanelColumns];
  for (int group = 0; group < kPanelGroups; ++group) {
    for (int byte = 0; byte < 4; ++byte) {
      for (int c = 0; c < kPanelColumns; ++c)
        wide[group * 4 + byte][c] = columns.bytes[group][c][byte];
    }
  }
  for (uint32_t r = 0; r < row_count; ++r) {
    int32_t sums[kPanelColumns] = {};
    for (int group = 0; group < kPanelGroups; ++group) {
      for (int byte = 0; byte < 4; ++byte) {
        const int16_t factor = rows.bytes[group][r][byte];
        for (int c = 0; c < kPanelColumns; ++c) sums[c] += factor * wide[group * 4 + byte][c];
      }
    }
    for (int c = 0; c < kPanelColumns; ++c) products[r][c] = sums[c];
  }
}

uint32_t ColumnsIn(uint32_t count, uint32_t first) {
  return count - first < kPanelColumns ? count - first : kPanelColumns;
}

void UpdateRow(uint32_t column, uint32_t distance, NearestPair* row) {
  if (distance < row->distance) {
    row->second_distance = row->distance;
    row->distance = distance;
    row->best = column;
  } else if (distance < row->second_distance) {
    row->second_distance = distance;
  }
}

void NearestBothWays(PanelSpan rows, PanelSpan columns, NearestPair* rows_out, Nearest* columns_out,
                     int32_t* /*column_keys*/) {
  for (uint32_t r = 0; r < rows.count; ++r) rows_out[r] = {kNoMatch, kNoMatch, kNoMatch};
  for (uint32_t c = 0; c < columns.count; ++c) columns_out[c] = {kNoMatch, kNoMatch};
  int32_t products[kPanelColumns][kPanelColumns];
  for (uint32_t first_row = 0; first_row < rows.count; first_row += kPanelColumns) {
    const DescriptorPanel& row_panel = rows.panels[first_row / kPanelColumns];
    const uint32_t row_count = ColumnsIn(rows.count, first_row);
    for (uint32_t first_column = 0; first_column < columns.count; first_column += kPanelColumns) {
      const DescriptorPanel& column_panel = columns.panels[first_column / kPanelColumns];
      const uint32_t column_count = ColumnsIn(columns.count, first_column);
      MultiplyPanels(row_panel, column_panel, row_count, products);
      for (uint32_t r = 0; r < row_count; ++r) {
        for (uint32_t c = 0; c < column_count; ++c) {
          const uint32_t distance = static_cast<uint32_t>(
              row_panel.norms_squared[r] + column_panel.norms_squared[c] - 2 * products[r][c]);
          UpdateRow(first_column + c, distance, &rows_out[first_row + r]);
          Nearest& column = columns_out[first_column + c];
          if (distance < column.distance) column = {first_row + r, distance};
        }
      }
    }
  }
}

void Distances(const uint8_t* query, const uint8_t* descriptors, const uint32_t* indices,
               size_t count, uint32_t* distances) {
  constexpr int kSize = kPanelGroups * 4;
  for (size_t i = 0; i < count; ++i) {
    const uint8_t* candidate = descriptors + static_cast<size_t>(indices[i]) * kSize;
    int32_t sum = 0;
    for (int k = 0; k < kSize; ++k) {
      const int16_t difference = static_cast<int16_t>(query[k] - candidate[k]);
      sum += difference * difference;
    }
    distances[i] = static_cast<uint32_t>(sum);
  }
}

constexpr MatcherKernels kKernels = {&NearestBothWays, &Distances};

}  // namespace

const MatcherKernels* const kMatcherKernelsPortable = &kKernels;

}  // namespace veduta
