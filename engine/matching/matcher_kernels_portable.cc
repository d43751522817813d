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

void UpdateNearest(uint32_t other, uint32_t distance, NearestPair* nearest) {
  if (distance < nearest->distance) {
    nearest->second_distance = nearest->distance;
    nearest->distance = distance;
    nearest->best = other;
  } else if (distance < nearest->second_distance) {
    nearest->second_distance = distance;
  }
}

void NearestBothWays(PanelSpan rows, PanelSpan columns, NearestPair* rows_out,
                     NearestPair* columns_out, int32_t* /*column_keys*/) {
  for (uint32_t r = 0; r < rows.count; ++r) rows_out[r] = {kNoMatch, kNoMatch, kNoMatch};
  for (uint32_t c = 0; c < columns.count; ++c) columns_out[c] = {kNoMatch, kNoMatch, kNoMatch};
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
          UpdateNearest(first_column + c, distance, &rows_out[first_row + r]);
          UpdateNearest(first_row + r, distance, &columns_out[first_column + c]);
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
