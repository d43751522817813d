// SPDX-License-Identifier: Apache-2.0
#pragma once
// The measurements of veduta-marker-bench, one function for each command. They print to standard
// output.

#include <optional>
#include <string>
#include <vector>

#include "engine/camera/markers/detector.h"
#include "tools/floor/floor_photo.h"

namespace veduta::floor {

// What became of one marker that is in a photo.
struct MarkerOutcome {
  MarkerTruth truth;
  bool is_found = false;
  double error_px = 0;  // of the feature point
  double error_x_px = 0, error_y_px = 0;
  double ellipse_error_px = 0;  // of the outline's centre
  double sigma_px = 0;
  double mahalanobis2 = 0;  // squared error in standard deviations, two degrees of freedom
};

struct PhotoOutcome {
  std::vector<MarkerOutcome> markers;  // those true of the photo
  int wrong_count = 0;                 // ids that are not there, or over 3 px from their place
};

PhotoOutcome Compare(const std::vector<MarkerTruth>& truths,
                     const std::vector<MarkerDetection>& found);

double Percentile(std::vector<double> values, double part);  // NaN of none

// One line: the rate over markers that are whole and uncovered, errors, sigma, wrong ids, and, if
// timed, the milliseconds of one core for each photo.
void PrintOutcome(const std::string& label, const std::vector<PhotoOutcome>& outcomes,
                  std::optional<double> seconds);

// Each returns the exit code.
int RunSession(const std::string& folder);  // of veduta-floor
// Size, tilt, blur, cover and so on: the settings whose names begin with `only`.
int RunSweep(uint32_t photos, const std::string& only);
int RunFalse(const std::vector<std::string>& paths);  // photos without markers
// Draws what was found in a photo into a PNG.
int RunDraw(const std::string& photo, const std::string& out, bool is_inverted);
int RunMutations(const std::vector<std::string>& paths, uint32_t count);  // damaged files

}  // namespace veduta::floor
