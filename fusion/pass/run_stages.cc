// SPDX-License-Identifier: Apache-2.0
#include "fusion/pass/run_stages.h"

#include "fusion/pass/staged_surface.h"

namespace veduta {

Status RunStages(const DenseStageOptions& options, DensePass* pass, DensifyReport* report) {
  VEDUTA_ASSIGN_OR_RETURN(report->depths, UpdateDepths(options.depths, options.tolerance, pass,
                                                       &report->without_depth));
  VEDUTA_ASSIGN_OR_RETURN(report->checks, CheckDepths(options.checks, options.tolerance, pass));
  VEDUTA_ASSIGN_OR_RETURN(report->volume, UpdateVolume(options.volume, options.allocation, pass));
  VEDUTA_ASSIGN_OR_RETURN(report->solutions, SolveTiles(options.fusion, pass));
  VEDUTA_ASSIGN_OR_RETURN(report->meshes, ExtractTiles(options.meshes, pass));
  VEDUTA_ASSIGN_OR_RETURN(report->exposures, UpdateExposures(options.exposures, pass));
  VEDUTA_ASSIGN_OR_RETURN(report->colors, ColorTiles(options.colors, pass));
  VEDUTA_RETURN_IF_ERROR(SwitchToStaged(pass));
  return SweepStale(pass);
}

}  // namespace veduta
