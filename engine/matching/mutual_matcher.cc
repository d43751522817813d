// SPDX-License-Identifier: Apache-2.0
#include "engine/matching/mutual_matcher.h"

#include <algorithm>

#include "engine/matching/matcher_kernels.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

bool Passes(const NearestPair& nearest, const MatchOptions& options) {
  if (nearest.distance > options.distance_squared_max) return false;
  if (options.ratio_max >= 1.0 || nearest.second_distance == kNoMatch) return true;
  return nearest.distance <= options.ratio_max * options.ratio_max * nearest.second_distance;
}

// Appends the match of a feature with its nearest one, where it passes.
void Append(FeatureIndex from, FeatureIndex to, const NearestPair& nearest,
            const MatchOptions& options, std::vector<DescriptorMatch>* matches) {
  if (Passes(nearest, options))
    matches->push_back({from, to, nearest.distance, nearest.second_distance});
}

void SortByFirst(std::vector<DescriptorMatch>* matches) {
  std::ranges::sort(*matches, {}, &DescriptorMatch::a);
}

}  // namespace

Status MatchOptions::Check() const {
  return OptionBounds().AboveUpTo("ratio_max", ratio_max, 0, 1).status();
}

MatchesBothWays MatchBothWays(const PackedDescriptors& a, const PackedDescriptors& b,
                              const MatchOptions& options) {
  MatchesBothWays matches;
  const MatcherKernels& kernels = BestMatcherKernels();
  std::vector<NearestPair> rows, columns;
  std::vector<int32_t> column_keys;
  for (int contrast = 0; contrast < kContrastClassCount; ++contrast) {
    const PanelSpan row_span = a.span(contrast);
    const PanelSpan column_span = b.span(contrast);
    if (row_span.count == 0 || column_span.count == 0) continue;
    rows.resize(row_span.count);
    columns.resize(column_span.count);
    column_keys.resize((column_span.count + kPanelColumns - 1) / kPanelColumns * kPanelColumns * 2);
    kernels.nearest_both_ways(row_span, column_span, rows.data(), columns.data(),
                              column_keys.data());
    for (uint32_t row = 0; row < row_span.count; ++row) {
      const uint32_t column = rows[row].best;
      if (columns[column].best != row) continue;
      const FeatureIndex in_a = a.feature(contrast, row), in_b = b.feature(contrast, column);
      Append(in_a, in_b, rows[row], options, &matches.from_a);
      Append(in_b, in_a, columns[column], options, &matches.from_b);
    }
  }
  SortByFirst(&matches.from_a);
  SortByFirst(&matches.from_b);
  return matches;
}

std::vector<DescriptorMatch> MatchMutual(const PackedDescriptors& a, const PackedDescriptors& b,
                                         const MatchOptions& options) {
  return MatchBothWays(a, b, options).from_a;
}

}  // namespace veduta
