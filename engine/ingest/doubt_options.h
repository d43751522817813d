// SPDX-License-Identifier: Apache-2.0
#pragma once
// Numbers by which poses and seams are doubted.

#include "engine/mapping/agreeing_parts.h"
#include "engine/mapping/visibility.h"
#include "storage/base/status.h"

namespace veduta {

struct DoubtOptions {
  // What a view must see: of a pose, and of a seam. A wrong pose sees a part of its picture well
  // and says nothing of how far the rest sees, so only what is near by hides. A seam joins two
  // sides that know their own pictures: a smooth wall is as far away as what is nearest to it.
  VisibilityOptions visibility;
  VisibilityOptions seam_visibility = {.hidden_reach_cells = 32};
  // >= 1. Images around a view whose points it is asked for. Chosen by hand; not measured.
  uint32_t images_max = 12;
  // (0, 90), degrees. Cameras side by side whose axes differ by less see the same, unless something
  // hides it. Chosen by hand; not measured.
  double beside_angle_deg_max = 30.0;
  // >= 1. Cells that must be missing before a pose is doubted, and (0, 1] their share of those that
  // were judged. Right poses on castle-P19, fountain-P11, museum, a street, a loop and a test's
  // street lacked 6 cells and 11 % at most where 20 cells or more were judged. Of wrong poses on
  // repeated facades this notices the grossest: they lacked from 2 to 33 cells, 5 to 60 %.
  uint32_t missing_cells_min = 5;
  double missing_share_max = 0.12;
  // Where an image may stand in either of two reconstructions that are not one, it belongs to the
  // other one if it is asked in better_cells_min cells there (>= 1) and lacks at most
  // better_missing_share_max of them ([0, 1]), while it lacks better_missing_cells_min cells (>= 1)
  // here, and a share that is larger by better_missing_share_max. On a street of 150 with twin
  // facades near each other, one image at the wrong twin lacked 3 of 23 to 4 of 33 cells there and
  // none of 41 at the right one; of 55 at the right one none met this.
  uint32_t better_cells_min = 20;
  uint32_t better_missing_cells_min = 3;
  double better_missing_share_max = 0.04;
  // An image at a seam that the evidence contradicts stands on either side as well if the other
  // side gives it a pose with so many points (>= 1) and such a share ((0, 1]) of those of that side
  // that it sees, and no more than a pose may lack is missing there. Of 578 images of six streets
  // with twin facades 24 stood at the wrong twin; 16 of them met this, and 49 of the others.
  uint32_t either_side_points_min = 60;
  double either_side_share_min = 0.75;
  // Where it sees fewer points of that side, it may stand there if its pairs across have so many
  // matches (>= 1), and as many each as those of its own side. Of 1,075 images of eleven streets
  // with twin facades this named three at the wrong twin, which nothing else did, and ten others.
  uint32_t either_side_matches_min = 100;
  // >= 1. An image at a seam that nothing contradicts goes to the other side if its pairs across
  // have so many times as many matches as those beside it (FindOutweighed). In 2 of 24 orders of a
  // rendered street of 24 photos one image stood 0.6 and 1.6 m off, with 1.9 and 2.2 times as many;
  // 70 of 95 and 73 of 96 points agreed with its pose there. Chosen by hand.
  double outweighing_factor = 1.5;
  // >= 1, and [0, 1]. Of two images of a reconstruction one contradicts the other if it lacks so
  // many cells, and a larger share, of what the other one sees. It shows two places if so many
  // pairs (>= 1) contradict each other across, and at most such a share of that within the two. On
  // two orders of a loop with twin facades at its ends 17 to 48 pairs of photos at the two twins
  // did, and 0 to 9 of one of them. Chosen by hand.
  uint32_t mixed_missing_cells_min = 3;
  double mixed_missing_share_max = 0.04;
  uint32_t mixed_pairs_min = 6;
  double mixed_within_share_max = 0.25;
  // > 0. The pairs that contradict each other across must be a larger share than this of the
  // verified pairs that agree across: a few contradict each other in any large place. In two orders
  // of a street without twins it was 2 to 15 % where the pictures would have parted it (once 39 %,
  // for a part of three images), so that 36 of its 78 images were parted and joined again with each
  // photo. Of four orders of two loops with twin facades at their ends it was 17 % and more.
  double mixed_agreeing_share_max = 0.16;
  // >= 1, and [0, 1]. So many pairs of images across a seam, and a larger share of all, must not
  // show two places. Of merges that nothing else refused 0 to 1 did on castle-P19 and a loop, and
  // 16 to 20 (20 to 29 %) where they took one twin facade for the other.
  uint32_t seam_mixed_pairs_min = 4;
  double seam_mixed_share_max = 0.05;
  // [0, 1]. That share for images that leave their place in a reconstruction as one body. Where
  // bodies would have gone to a twin facade at the other end of a loop it was 37 to 80 %; where
  // they went right on a street, and would have stood 1.5 m off otherwise, 0 to 7 %.
  double body_mixed_share_max = 0.2;
  // >= 1. Verified pairs that must agree across a seam: one alone may be a repeated facade. Chosen
  // by hand; not measured.
  uint32_t seam_pairs_min = 2;
  // > 0. How far leaving out one photo may move the cameras at a seam, over how far they see.
  // Of the merges that a street of 1,500 photos and 16 orders of castle-P19 proposed, the wrong
  // ones reached 5.8 to 191 %, or nothing was left without one photo; right ones began at 0.02 %.
  // Some right ones wait for more photos thereby.
  double seam_jackknife_share_max = 0.03;
  // >= 1. Matches of one pair, or points missing between two images, that count at most: on
  // castle-P19 two pairs of lookalike facades have 376 and 307 matches and are wrong, and a pair is
  // one witness. Chosen by hand; not measured.
  uint32_t pair_weight_max = 100;
  // > 0. Matches across a seam that contradict a merge, over those that agree. As
  // AgreementBounds::contradiction_share_max.
  double seam_contradiction_share_max = 0.7;
  // That share where both sides see each other well: where the pictures are asked in
  // seam_confirmed_cells_min cells (>= 1) and lack seam_confirmed_missing_share_max ([0, 1]) at
  // most. Lookalike facades give pairs that contradict a right merge: on castle-P19 4 did and 6
  // agreed (342 matches and 391), and 1 of 72 cells was missing. Chosen by hand; not measured.
  double seam_confirmed_contradiction_share_max = 1.0;
  uint32_t seam_confirmed_cells_min = 40;
  double seam_confirmed_missing_share_max = 0.05;
  // (0, 1]. Share of the cells that a merge may leave missing, of missing_cells_min and more. Right
  // merges of orders of a street, a loop and castle-P19 left 0 to 10 %; wrong ones that took one
  // twin facade for the other 15 to 64 %, and 80 to 88 % on castle-P19.
  double seam_missing_share_max = 0.12;
  // >= 1, and (0, 1]. No image may lack so many cells and such a share of those it is asked, though
  // all together lack little. Where 16 of a street's merges were right it was 5 cells at most, and
  // 13 to 22 (of 42 to 56) where they took one end of the street for another.
  uint32_t seam_view_missing_cells_min = 10;
  double seam_view_missing_share_max = 0.2;
  // (0, 1]. Cameras side by side that lack a larger share of what the other sees speak against each
  // other. Chosen by hand; not measured.
  double beside_missing_share_max = 0.35;
  // >= 1. A photo that raises doubt has the whole reconstruction judged when so many images have
  // come since it was judged last, or 1 % of it. Chosen by hand; not measured.
  uint32_t images_between_min = 3;
  // > 0. A photo raises doubt whose verified matches contradict its pose by a larger share of those
  // that agree. Chosen by hand; not measured.
  double raising_contradiction_share_min = 0.2;
  AgreementBounds parts;

  Status Check() const;
};

}  // namespace veduta
