// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where the photographer stands and looks.

#include <vector>

#include "tools/render/street/photo.h"

namespace veduta::street {

enum class Trajectory : uint8_t {
  kStreet,    // along each street and back, the left houses first, then the right ones
  kLoop,      // once around a block, looking outwards; the end meets the start
  kOrbit,     // around a house
  kTwoSites,  // two stretches of one street that share nothing, then a bridge of photos between
              // them
};

struct RigOptions {
  Trajectory trajectory = Trajectory::kStreet;
  uint32_t photos = 72;             // [1, 1000000]
  CameraModel model;                // of every photo
  double position_jitter_m = 0.15;  // [0, 0.5], each way
  double angle_jitter_deg = 2.5;    // [0, 20], of yaw, pitch and roll
  bool bridge = true;               // kTwoSites: with the photos that join the sites
  bool shuffle = false;             // names do not follow the walk
  uint64_t seed = 1;

  Status Check() const;
};

// The layout and a length that suit a trajectory, so that a point is seen in 4 to 10 photos.
//
// length_m  of the walk; 0 chooses it from the number of photos. Streets longer than 400 m become a
// grid.
SceneOptions SceneForTrajectory(Trajectory trajectory, uint32_t photos, double length_m);

// The photographer's poses, named photo0001.jpg and so on. The trajectory must suit the scene's
// layout. Deterministic. kInvalidArgument on bad options.
Result<std::vector<StreetCamera>> MakeCameras(const SceneOptions& scene, const RigOptions& options);

// A camera at `center` looking along `yaw_deg` (from +x towards +y), `pitch_deg` up, rolled
// clockwise by `roll_deg`.
Rigid3 LookFrom(const Eigen::Vector3d& center, double yaw_deg, double pitch_deg, double roll_deg);

}  // namespace veduta::street
