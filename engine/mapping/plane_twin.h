// SPDX-License-Identifier: Apache-2.0
#pragma once
// A plane looks the same from a second pose: the matches of two views of one house front have two
// relative poses that explain them equally well (Longuet-Higgins, "The reconstruction of a plane
// surface from two perspective projections", 1986; Ma, Soatto, Kosecka and Sastry, "An Invitation
// to 3-D Vision", section 5.3.3). A third view tells them apart, unless it is far away.

#include <Eigen/Core>
#include <optional>
#include <span>

#include "storage/base/transform.h"

namespace veduta {

// The plane on which most of the points X lie, as the n with n . X = 1 there; the points are in the
// frame of a camera, in front of it. Nothing where they do not give a plane: fewer than three, or
// all on a line. Deterministic. O(points).
std::optional<Eigen::Vector3d> FitPlane(std::span<const Eigen::Vector3d> points);

// The other relative pose that maps the plane (as FitPlane gives it, in the frame of a) as
// `b_from_a` does; its translation has length 1. `ray` leads from a to what is seen of the plane.
// Nothing where there is no other pose: the baseline is along the plane's normal, or there is none.
std::optional<Rigid3> PlaneTwin(const Rigid3& b_from_a, const Eigen::Vector3d& plane,
                                const Eigen::Vector3d& ray);

}  // namespace veduta
