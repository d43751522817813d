// SPDX-License-Identifier: Apache-2.0
#pragma once
// What speaks for and against joining two reconstructions by a similarity: not only the points that
// agree, but all verified pairs across the seam, and what the pictures of one side lack of the
// other.

#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/ingest/mapping_context.h"
#include "engine/mapping/pair_matches.h"
#include "engine/mapping/similarity.h"
#include "engine/mapping/visibility.h"
#include "storage/model/hypothesis.h"

namespace veduta {

// A verified pair across a seam: `a` lies in the one reconstruction, the pair's `other` in the
// other.
struct SeamPair {
  ImageId a;
  PairMatches matches;
};

// Where two reconstructions meet.
struct SeamArea {
  std::vector<SeamPair> pairs;  // ascending images
  // The images of the pairs, and those that share most points with them; ascending.
  std::vector<ImageId> into, other;
  // Of the images of the pairs those whose focal lengths may not be known well
  // (uncertain_lenses.h).
  std::set<ImageId> uncertain;
};

struct SeamEvidence {
  uint32_t agreeing_pairs = 0, contradicting_pairs = 0;
  uint64_t agreeing_matches = 0, contradicting_matches = 0;
  VisibleStructure visible;  // summed over the images of both sides
  VisibleStructure worst;    // that of the image that lacks most
  // Pairs of images across, one of which lacks what the other one alone sees (IsOfAnotherPlace),
  // and all that there are. Counted only where nothing else refuses.
  uint32_t mixed_pairs = 0, compared_pairs = 0;
  // How sure it is where the other side's cameras stand: how far they move where any one image of
  // the pairs is left out (the jackknife; Efron and Stein 1981), or may be off by errors of 1 px of
  // the rest, over how far they see. The median of the cameras with pairs, and the most of the
  // images left out. Infinite where nothing is left that says it. Measured only where nothing else
  // refuses.
  std::optional<double> jackknife_share;

  // Why the two are not believed to be one; nothing where they are.
  std::optional<RefusalReason> Refusal(const DoubtOptions& options) const;
  bool Holds(const DoubtOptions& options) const { return !Refusal(options); }
  // Whether the pictures of one side lack what the other side sees, all in all, one of them, or a
  // larger share than this of the pairs across.
  bool LacksStructure(const DoubtOptions& options, double mixed_share_max) const;
  // "12 pairs agree, 3 contradict; 4 of 120 parts of the pictures lack ...".
  std::string Text() const;
};

// Where two reconstructions meet: the verified pairs across that images near the seam have (those
// of the photo, `pairs`, which need not be stored yet, of the `near` images, which lie with it, and
// of the images that these lead to), and the images around them. Where `pairs` is empty, `photo` is
// any of the `near` images. Loads the images with their neighbourhoods.
Result<SeamArea> FindSeam(MapLoader* loader, const CityMap& map, ImageId photo,
                          std::span<const PairMatches> pairs, std::span<const ImageId> near,
                          ReconstructionId other);

// The verified pairs of the seam alone, ascending (FindSeam). Loads only the images of the pairs.
Result<std::vector<SeamPair>> ListSeamPairs(MapLoader* loader, const CityMap& map, ImageId photo,
                                            std::span<const PairMatches> pairs,
                                            std::span<const ImageId> near, ReconstructionId other);

// What the cameras of either side see of the other side's points, by the matches of the pairs.
struct CrossSightings {
  std::vector<CrossSighting> in_into, in_other;  // the side of the cameras
};
CrossSightings ListCrossSightings(const CityMap& map, const SeamArea& seam);

// Moves a similarity that carries the frame of the other side into that of `into` to where all that
// is seen across and agrees with it wants it.
Sim3 RefineSeam(const CrossSightings& seen, const Sim3& into_from_other);

// Judges a similarity between the two sides of a seam. What FindSeam loads must be loaded. Reads
// the map only.
SeamEvidence JudgeSeam(const CityMap& map, const SeamArea& seam, const Sim3& into_from_other,
                       const MapperOptions& options);

// What the pictures alone say of the similarity. As JudgeSeam, which asks the pairs as well.
SeamEvidence AskPictures(const CityMap& map, const SeamArea& seam, const Sim3& into_from_other,
                         const MapperOptions& options);

// The pairs of the seam that a similarity explains, and those that it does not. As JudgeSeam.
std::vector<SeamPair> PairsFor(const CityMap& map, const SeamArea& seam,
                               const Sim3& into_from_other, const MapperOptions& options);
std::vector<SeamPair> PairsAgainst(const CityMap& map, const SeamArea& seam,
                                   const Sim3& into_from_other, const MapperOptions& options);

// The images of either side that have most matches across, ascending: where the merge is to be
// judged anew. O(pairs log pairs).
std::vector<ImageId> SeamImages(std::span<const SeamPair> pairs);

// The merge of `own` and `other` as one that is not believed, with the votes; common points, images
// and the photo that proposed it are the caller's to fill in.
HypothesisRecord HypothesisOf(ReconstructionId own, ReconstructionId other,
                              const Sim3& own_from_other, const SeamEvidence& evidence,
                              RefusalReason reason);

}  // namespace veduta
