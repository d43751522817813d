// SPDX-License-Identifier: Apache-2.0
#pragma once
// How a person is told of merges that are not believed yet.

#include "engine/engine.h"

namespace veduta {

// One line: "  reconstructions 1 and 3 are not believed to be one: ...".
void PrintHypothesis(const HypothesisAnswer& hypothesis);

}  // namespace veduta
