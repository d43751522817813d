// SPDX-License-Identifier: Apache-2.0
#pragma once
// A textured plane of the street and what it is made of. Plain data without Eigen: the vector code
// reads it.

#include <cstdint>

namespace veduta::street {

enum class Material : uint32_t {
  kPlaster,
  kBrick,
  kAshlar,  // large stone blocks
  kTrim,    // sills, cornices, balconies
  kWindow,  // frame, bars and what stands behind the glass; fills Surface::size
  kDoor,    // planks within a frame; fills Surface::size
  kPoster,  // random print
  kAsphalt,
  kPavement,  // slabs
  kRoof,
  kLeaf,
  kPaint,  // cars
  kCount
};

// The texture is a function of (s, t) in metres, of the seed and of the material, so nothing
// repeats and nothing is stored: a point is origin + s u + t v.
struct Surface {
  float origin[3];   // world, m
  float u[3], v[3];  // unit vectors, world
  float normal[3];   // u x v, outward
  float tint[3];     // linear reflectance times the light that falls on the plane
  float size[2];     // m along u and v; for kWindow and kDoor
  uint32_t seed;
  Material material;
};

// How one material looks. Lengths in m, amplitudes relative to the tint.
struct MaterialLook {
  float brick_width, brick_height, mortar_width;  // brick_width 0: no joints
  float brick_contrast;                           // how far bricks differ from each other
  float stagger;                                  // shift of every second course, in bricks
  float noise;                                    // per octave of band-limited noise
  float stain;                                    // per octave of spots with an edge
  float print_cell;                               // size of a dot of random print; 0: none
  float frame_width;                              // of windows and doors; 0: none
};

}  // namespace veduta::street
