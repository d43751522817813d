// SPDX-License-Identifier: Apache-2.0
#include "kernels/total_variation_lanes.inc"

namespace veduta {

TvSteps TvStepsAvx512() {
  return {DualStep, PrimalStep, EnergyOf};
}

}  // namespace veduta
