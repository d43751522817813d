// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a person reads of a hypothesis.

#include <string>

#include "storage/model/hypothesis.h"

namespace veduta {

// Why the merge is not believed, with the votes, as a clause: "pairs contradict it: 2 pairs agree,
// 5 contradict; ...".
std::string RefusalText(const HypothesisRecord& hypothesis);

}  // namespace veduta
