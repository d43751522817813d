// SPDX-License-Identifier: Apache-2.0
#include "engine/mapping/pair_matches.h"

#include <algorithm>
#include <utility>

namespace veduta {

PairMatches MatchesFrom(const PairRecord& pair, ImageId image) {
  PairMatches seen{image == pair.a ? pair.b : pair.a,
                   pair.geometry,
                   pair.b_from_a,
                   pair.matches,
                   pair.lens_a,
                   pair.lens_b};
  if (image == pair.b) {
    std::swap(seen.lens_photo, seen.lens_other);
    seen.other_from_photo = pair.b_from_a.Inverse();
    for (FeatureMatch& match : seen.matches) std::swap(match.a, match.b);
  }
  return seen;
}

PairRecord RecordOf(const PairMatches& pair, ImageId photo) {
  PairRecord record{photo,        pair.other,      pair.geometry,  pair.other_from_photo,
                    pair.matches, pair.lens_photo, pair.lens_other};
  if (pair.other < photo) {
    std::swap(record.a, record.b);
    std::swap(record.lens_a, record.lens_b);
    record.b_from_a = record.b_from_a.Inverse();
    for (FeatureMatch& match : record.matches) std::swap(match.a, match.b);
  }
  std::sort(record.matches.begin(), record.matches.end(),
            [](const FeatureMatch& x, const FeatureMatch& y) { return x.a < y.a; });
  return record;
}

}  // namespace veduta
