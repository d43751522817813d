// SPDX-License-Identifier: Apache-2.0
#include "kernels/total_variation_lanes.inc"

namespace veduta {

TvSteps TvStepsBaseline() {
  return {DualStep, PrimalStep, EnergyOf};
}

}  // namespace veduta
