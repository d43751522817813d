// SPDX-License-Identifier: Apache-2.0
#pragma once
// The dense pass and what comes of it, as the door offers them: depth maps, surfaces, models for
// other programs, pictures. Standard library and plain structs only.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/device_info.h"
#include "storage/base/ids.h"
#include "storage/base/status.h"

namespace veduta {

struct DensifyOptions {
  // Kept with the reconstruction. Unset: as last time, and the first time as said.
  std::optional<uint32_t>
      depth_side_px;                     // longer side of a depth map; 512, the paper's; 0: photo's
  std::optional<uint32_t> sensor_count;  // [1, 16]; 2, the paper's
  std::optional<double> voxel_size;      // > 0, world units; `voxel_px` at the median depth

  double voxel_px = 1.5;           // (0, 100]; the first voxel size, in pixels of the depth maps
  uint32_t neighbor_count = 6;     // [1, 16]; depth maps that a depth map is checked against
  double moved_px_max = 0.35;      // (0, 10]; a depth map is kept while its points move no further
  double moved_voxels_max = 0.35;  // (0, 10]; and integrated where it is while they move no further
  double depth_margin = 0.25;      // [0, 10]; of the range of depths that is searched
  uint32_t block_pixel_count_min = 16;  // >= 1; pixels, over all maps, that allocate a block
  uint32_t block_map_count_min = 2;     // >= 1; and maps: what one alone sees is no surface

  Status Check() const;  // the first violated bound, named with its value
};

struct DensifyReport;

struct DensifyRequest {
  ReconstructionId reconstruction;  // not valid(): every living one, largest first
  std::string device = "auto";      // as `veduta devices` lists them; "cpp" for none
  std::string cache_folder;         // built OpenCL programs are kept here; empty: in memory only
  DensifyOptions options;
  // Told after each piece: stage, pieces looked at, pieces in all. May be empty.
  std::function<void(std::string_view stage, size_t done, size_t total)> progress;
  // Told when a reconstruction is done, before the next one is begun. May be empty.
  std::function<void(const DensifyReport&)> report;

  Status Check() const;  // the first violated bound, named with its value
};

struct StageCount {
  uint64_t computed = 0, kept = 0, removed = 0;
  uint64_t units = 0;  // depth stages: pixels with a depth made now; volume: blocks changed
  double ms = 0;
};

// A photo that got no depth map, and why, for a person.
struct PassedOver {
  ImageId image;
  std::string name, reason;
};

// What one pass did to one reconstruction.
struct DensifyReport {
  ReconstructionId reconstruction;
  std::string device;   // its name, or "C++"
  std::string why_cpp;  // a sentence, where C++ works because "auto" found no device
  // Valid: the reconstruction was merged into this one while the pass ran. The pass ended there,
  // and what it had made is deleted.
  ReconstructionId merged_into;
  bool dissolved = false;  // all its photos lost their poses meanwhile; the pass ended as well
  double voxel_size = 0;
  uint32_t depth_side_px = 0, sensor_count = 0;
  StageCount depths, checks, volume, solutions, meshes, exposures, colors;
  std::vector<PassedOver> without_depth;  // ascending images
  uint64_t triangles = 0, vertices = 0, tiles = 0;
};

struct DeviceList {
  std::vector<DeviceInfo> devices;
  std::optional<uint32_t> chosen;  // the index of the one that would work; none: C++ does
  std::string why_none;            // a sentence, where none is chosen
};

// One format is one file of the program (an Exporter); ExportFormats() names them all.
struct ExportRequest {
  std::string folder;    // made; must not exist, or be empty
  std::string format;    // one of ExportFormats()
  double error_max = 0;  // >= 0, world units; surfaces: triangles are joined while the
                         // surface moves no further; 0: all stay
  // "ply" and "gltf": in metres to the east, the north and above an origin on the earth, where the
  // place of a reconstruction is known (EarthAnswer); other ones stay as they are. earth.json in
  // the folder of each model says where that is, of all formats.
  bool on_earth = false;
  // With photos that a curator has hidden: their names, poses and pictures. What the map holds by
  // them is there anyway.
  bool with_hidden = false;

  Status Check() const;  // the first violated bound, named with its value
};

struct ExportedModel {
  ReconstructionId reconstruction;
  std::string folder;
  uint64_t images = 0, points = 0, vertices = 0, triangles = 0;
  bool may_have_surface = false;  // the format has one, where Densify has made it
  bool on_earth = false;          // it is in metres on the earth, as was asked
};

struct RenderRequest {
  std::string path;                 // PNG to write
  ReconstructionId reconstruction;  // not valid(): the largest; only without `from`
  std::string from;                 // an image, by name or #number: its own camera
  bool compare = false;             // with `from`: photo, picture and difference side by side
  std::string side = "front";       // without `from`: "front", "left" or "right"
  std::string shading = "color";    // "color", "clay" or "normal"
  bool points = false;              // the sparse points, also where there is a surface
  uint32_t side_px = 0;             // [16, 16384]; longer side; 0: the photo's, or 1600

  Status Check() const;  // the first violated bound, named with its value
};

// How a picture from a photo's camera differs from the photo.
struct RenderReport {
  double covered_share = 0;          // [0, 1] of the photo's pixels show the surface
  double error_median = 0;           // absolute, of 255
  double error_median_balanced = 0;  // with the photo's exposure balanced
};

// A surface as OGC 3D Tiles 1.1, for viewers that load of it what they draw: in metres about the
// earth's centre where the place of the reconstruction is known, otherwise in its own frame. Takes
// a record of each tile. A content is a binary glTF; its name stands for the same bytes for ever.
// Fine ones take some milliseconds; a coarse one is made of all that it covers, and is kept then,
// within bounds (fusion/surface_tiles.h).
struct TilesetAnswer {
  std::string tag;   // stands for these bytes: another surface, or place on the earth, has another
  std::string json;  // the tileset.json; contents are "tiles/NAME.glb"
};

// A content of a tileset.
struct SurfaceTileAnswer {
  std::vector<uint8_t> glb;
  // Damage: a sentence for each part of a coarse one that could not be read, and is left out. The
  // bytes are not those that the name stands for then.
  std::vector<std::string> left_out;
};

// What the dense pass has made of one photo.
struct DepthMapAnswer {
  uint32_t width_px = 0, height_px = 0;
  double known_share = 0;                // [0, 1] of the pixels have a depth
  double depth_near = 0, depth_far = 0;  // world units
  std::vector<std::string> sensors;      // names of the photos it was computed from, best first
  uint64_t geometry_version = 0;         // of the reconstruction when it was made
};

}  // namespace veduta
