// SPDX-License-Identifier: Apache-2.0
#pragma once
// Doubt after belief: what of a reconstruction its own evidence speaks against. Images whose
// pictures lack what the others say must be there, and parts that few points hold together against
// many verified matches.

#include <set>
#include <span>
#include <string>
#include <vector>

#include "engine/ingest/mapping_context.h"
#include "engine/mapping/agreeing_parts.h"
#include "engine/mapping/visibility.h"

namespace veduta {

// How much of what the images around it see is found in a view with a pose in their frame. The view
// need not be in the map; `around` must be loaded with its neighbourhood.
VisibleStructure FindAround(const CityMap& map, const MapImage& view,
                            std::span<const ImageId> around, const DoubtOptions& options);

// The same, for who asks whether the pose can be right: where it would be contradicted, what is
// surely visible (sure_visibility.h) counts alone if the view fits well by that. A part of a street
// that no camera has seen from near by may hide what stands behind it.
VisibleStructure JudgeAround(const CityMap& map, const MapImage& view,
                             std::span<const ImageId> around, const DoubtOptions& options);

// Whether so much is missing that the pose cannot be right.
bool IsContradicted(const VisibleStructure& visible, const DoubtOptions& options);
// Whether what two sides see of each other is so much, and all there, that more pairs across may
// contradict (DoubtOptions::seam_confirmed_cells_min).
bool IsConfirmed(const VisibleStructure& across, const DoubtOptions& options);
// Whether a view would stand well there: what would show that it does not is asked and found.
bool FitsWell(const VisibleStructure& there, const DoubtOptions& options);

// Whether a view would stand clearly better `there` than `here`: it fits well there, and lacks
// something here.
bool IsClearlyBetter(const VisibleStructure& there, const VisibleStructure& here,
                     const DoubtOptions& options);
// Whether a view lacks so much of what one other image sees that they show two places
// (DoubtOptions::mixed_missing_cells_min).
bool IsOfAnotherPlace(const VisibleStructure& of_one, const DoubtOptions& options);

// "12 of 46 cells of the picture lack what other photos see there".
std::string MissingText(const VisibleStructure& visible);

struct DoubtedImage {
  ImageId image;
  std::string why;  // for a person
};

// A camera whose lens was refined.
struct RefinedLens {
  CameraId camera;
  CameraModel model;
  // Standard deviation of the focal length over itself; 0 where the photos do not tell it.
  double stddev_share = 0;
};

// What becomes of a reconstruction that is not believed any more as it is.
struct Healing {
  std::vector<DoubtedImage> unplaced;       // in the order in which they lost their poses
  std::vector<std::vector<ImageId>> parts;  // that are split off: images ascending, three or more

  // What that rests on: the evidence for each two of the images and those around them, and all
  // parts that agree, as they were before anything was taken out.
  std::vector<PairEvidence> evidence;
  std::vector<std::vector<ImageId>> agreeing;

  // How cameras that the images have were refined before that.
  std::vector<RefinedLens> lenses;

  // Whether nothing is taken out.
  bool empty() const { return unplaced.empty() && parts.empty(); }
};

// Cuts off parts that do not agree with the largest one (agreeing_parts.h), by verified pairs and
// by what cameras side by side lack of each other, unless the pictures confirm where they stand, by
// which a merge would be believed, too (IsConfirmed). Then takes the poses of images that are
// contradicted, the most contradicted first. Images of parts of less than three lose theirs, too.
// `known` are `images` and all that share points with them, of one reconstruction, loaded with
// their neighbourhoods, with nothing else unwritten; both ascending. Nothing but `images` is cut
// off or loses its pose: a part that reaches out of them stays, for what holds it there is not
// known. What is split off stays in the reconstruction until the caller moves it. Deterministic.
Result<Healing> HealRegion(const MappingContext& context, std::span<const ImageId> images,
                           std::span<const ImageId> known);

}  // namespace veduta
