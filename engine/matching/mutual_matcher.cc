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

}  // namespace

Status MatchOptions::Check() const {
  return OptionBounds().AboveUpTo("ratio_max", ratio_max, 0, 1).status();
}

std::vector<DescriptorMatch> MatchMutual(const PackedDescriptors& a, const PackedDescriptors& b,
                                         const MatchOptions& options) {
  std::vector<DescriptorMatch> matches;
  const MatcherKernels& kernels = BestMatcherKernels();
  std::vector<NearestPair> rows;
  std::vector<Nearest> columns;
  std::vector<int32_t> column_keys;
  for (int contrast = 0; contrast < kContrastClassCount; ++contrast) {
    const PanelSpan row_span = a.span(contrast);
    const PanelSpan column_span = b.span(contrast);
    if (row_span.count == 0 || column_span.count == 0) continue;
    rows.resize(row_span.count);
    columns.resize(column_span.count);
    column_keys.resize((column_span.count + kPanelColumns - 1) / kPanelColumns * kPanelColumns);
    kernels.nearest_both_ways(row_span, column_span, rows.data(), columns.data(),
                              column_keys.data());
    for (uint32_t row = 0; row < row_span.count; ++row) {
      const NearestPair& nearest = rows[row];
      if (columns[nearest.best].best != row || !Passes(nearest, options)) continue;
      matches.push_back({a.feature(contrast, row), b.feature(contrast, nearest.best),
                         nearest.distance, nearest.second_distance});
    }
  }
  std::sort(
      matches.begin(), matches.end(),
      [](const DescriptorMatch& left, const DescriptorMatch& right) { return left.a < right.a; });
  return matches;
}

}  // namespace veduta
