// SPDX-License-Identifier: Apache-2.0
#include "cli/earth_pose_text.h"

#include "cli/output.h"

namespace veduta {

void PrintEarthPose(const EarthPose& pose, const std::string& indent) {
  PrintLine(
      "%slatitude %.7f, longitude %.7f, height %.2f m, heading %.1f degrees; standard deviation "
      "%.2g m on the plan, %.2g m in height, %.2g degrees (place %u)",
      indent.c_str(), pose.position.latitude_deg, pose.position.longitude_deg,
      pose.position.height_m, pose.heading_deg, pose.horizontal_stddev_m, pose.vertical_stddev_m,
      pose.heading_stddev_deg, pose.version);
}

}  // namespace veduta
