// SPDX-License-Identifier: Apache-2.0
#include "engine/query/invariants.h"

#include "engine/query/checked_city.h"

namespace veduta {

Result<std::vector<std::string>> FindViolations(const Snapshot& snapshot,
                                                const CheckOptions& options) {
  Violations violations(options.count_max);
  CheckedCity city(snapshot, options.deep, options.preparer);
  if (options.deep) VEDUTA_RETURN_IF_ERROR(violations.Note(snapshot.VerifyChecksums()));
  VEDUTA_RETURN_IF_ERROR(LoadCity(&city, &violations));
  for (const auto check : {CheckImages, CheckJournal, CheckPairs, CheckStructure, CheckVocabulary,
                           CheckUploads, CheckContributions})
    VEDUTA_RETURN_IF_ERROR(check(city, &violations));
  return violations.Take();
}

}  // namespace veduta
