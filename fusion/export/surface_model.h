// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the exporters and the pictures of surfaces have in common: a reconstruction's points,
// cameras and tiles, from the database.

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "engine/door/dense.h"
#include "fusion/pass/tile_parts.h"
#include "fusion/surface/model_writer.h"
#include "storage/database.h"

namespace veduta {

// Everything of one reconstruction but its tiles' triangles.
struct SurfaceModel {
  ReconstructionRecord record;
  std::vector<CloudPoint> points;
  std::vector<ExportedCamera> cameras;  // ascending images
  std::vector<Rigid3> upright_cams;     // what they would be if their photos were stored upright
  TileRecords tiles;

  // Zeroes where there is no surface yet.
  ExportedModel Counts(const std::string& folder, const ModelCounts& written) const;
};

// The pose that the camera of the image would have if its photo were stored upright.
Rigid3 UprightCam(const ImageRecord& image, const Rigid3& cam_from_world);

// Some tile has triangles.
bool HasSurface(const TileRecords& tiles);

// Errors: as LoadScene.
// `with_hidden` as of ListUntold.
Result<SurfaceModel> LoadSurfaceModel(const Snapshot& snapshot, const ReconstructionRecord& record,
                                      bool with_hidden);
Result<std::vector<CloudPoint>> LoadPoints(const Snapshot& snapshot,
                                           const ReconstructionRecord& record);

// Hands the surface of every tile to the writer, one tile at a time; with `error_max` above 0
// simplified by so much, in world units.
Status AddTiles(const Snapshot& snapshot, const TileRecords& tiles, double error_max,
                ModelWriter* writer);

// A box that holds 98 % of the surface along each axis, or of the points where there is no surface.
// kNotFound when there are no points either.
Result<Eigen::AlignedBox3d> BoxOf(const Snapshot& snapshot, ReconstructionId reconstruction);

}  // namespace veduta
