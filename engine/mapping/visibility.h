// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a photo fails to see: points that must be in the picture if its pose is right, and are not
// found there. Zach, Irschara and Bischof, "What can missing correspondences tell us about 3D
// structure and motion?", CVPR 2008. A repeated facade gives a wrong pose as many matches as a
// right one, but not the trees, cars and signs in front of it.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/mapping/city_map.h"
#include "storage/base/status.h"

namespace veduta {

struct VisibilityOptions {
  // (0, 90), degrees. A point is expected where another image sees it from a direction that differs
  // by less: SIFT finds most features again up to there (Lowe 2004, section 6).
  double angle_deg_max = 15.0;
  // > 1. And from a distance that is at most so many times larger or smaller. Chosen by hand;
  // not measured.
  double distance_ratio_max = 1.5;
  // > 0, px. Where a point falls, a feature that looks like it is sought within this distance.
  // Chosen by hand; not measured.
  double search_radius_px = 6.0;
  // >= 1. Squared distance of two descriptors up to which they may show the same place; as that of
  // GrowthOptions.
  uint32_t descriptor_distance_squared_max = 90'000;
  // >= 1. The picture is judged in so many cells each way. Chosen by hand; not measured.
  uint32_t cells_each_way = 8;
  // >= 1. Expected points that a cell is judged by, at least. Chosen by hand; not measured.
  uint32_t cell_points_min = 6;
  // [0, 1]. A cell contradicts the pose when a smaller share of its points is found. Chosen by
  // hand; not measured.
  double cell_found_share_min = 0.1;
  // >= 1. What the view sees itself is known in so many cells each way. Chosen by hand; not
  // measured.
  uint32_t depth_cells_each_way = 32;
  // > 1. A point that is so many times as far away as what the view sees there is hidden behind it.
  // At a street's corner 300 points of the side street were asked of photos of the house before it:
  // they lay at 8 to 28 m, the house at 4 to 5.
  double hidden_depth_ratio_min = 1.25;
  // >= 1. What the view sees there is looked for in so many cells around at most, nearest first.
  // Chosen by hand; not measured.
  uint32_t hidden_reach_cells = 1;

  Status Check() const;
};

struct VisibleStructure {
  uint32_t expected = 0, found = 0;       // points
  uint32_t cells = 0, missing_cells = 0;  // cells that were judged, and those that contradict

  double missing_share() const {
    return cells == 0 ? 0.0 : static_cast<double>(missing_cells) / static_cast<double>(cells);
  }
};

// Where an image sees a point that it has a part in, and how far in front of the camera.
struct SeenDepth {
  Eigen::Vector2d x_px;
  double depth;
};

// The points that an image of the map sees, in the order of its features. The map has its pose and
// points.
std::vector<SeenDepth> ListSeenDepths(const CityMap& map, const MapImage& image);

// A point that must be in a picture, and the feature of the picture that shows it, if one does.
struct ExpectedPoint {
  PointId point;
  Eigen::Vector2d x_px;  // where the pose puts it
  std::optional<FeatureIndex> found;
};

// Which of `points` must be seen in a view whose pose is given in their frame. Only points that two
// images other than the view see are asked, and none behind what the view sees itself (`seen`, in
// the scale of the points). The view need not be in the map; the images of the points' tracks must
// be. Reads the map only. O(points * track length).
std::vector<ExpectedPoint> ListExpected(const CityMap& map, const MapImage& view,
                                        std::span<const SeenDepth> seen,
                                        std::span<const PointId> points,
                                        const VisibilityOptions& options);

// How much of what must be seen (ListExpected) is found, by parts of the picture.
VisibleStructure FindVisible(const CityMap& map, const MapImage& view,
                             std::span<const SeenDepth> seen, std::span<const PointId> points,
                             const VisibilityOptions& options);

// FindVisible of those of `points` that each of `images` (ascending) sees, in the order of the
// images. What several images see hides that one of them sees a place that the view does not show.
// O(points * track length + images * cells).
std::vector<VisibleStructure> FindVisibleOfEach(const CityMap& map, const MapImage& view,
                                                std::span<const SeenDepth> seen,
                                                std::span<const PointId> points,
                                                std::span<const ImageId> images,
                                                const VisibilityOptions& options);

}  // namespace veduta
