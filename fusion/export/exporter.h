// SPDX-License-Identifier: Apache-2.0
#pragma once
// Reconstructions in the formats of other programs. A new format is one file here that makes an
// Exporter, and its line in the list of exporter.cc.

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/door/dense.h"
#include "storage/database.h"

namespace veduta {

// Writes reconstructions of one snapshot in one format.
class Exporter {
 public:
  virtual ~Exporter() = default;
  // Fills `folder`, which is there and empty. kIoError with the path.
  virtual Result<ExportedModel> Write(const ReconstructionRecord& reconstruction,
                                      const std::string& folder) = 0;
};

struct ExportFormat {
  const char* name;  // as ExportRequest::format has it
  bool has_surface;  // where there is one
  // The snapshot must outlive the exporter.
  std::unique_ptr<Exporter> (*make)(const Snapshot& snapshot, const ExportRequest& request);
};

// All formats, in the order in which a person is told of them.
std::span<const ExportFormat> ListExportFormats();

// Their names; engine/engine.h declares the same function.
std::vector<std::string> ExportFormats();

// Writes every living reconstruction into FOLDER/0, FOLDER/1, ... largest first (ties: lower id).
// kInvalidArgument on a bad request; kAlreadyExists when the folder exists and is not empty;
// kIoError with the path.
Result<std::vector<ExportedModel>> ExportReconstructions(const Snapshot& snapshot,
                                                         const ExportRequest& request);

// Makers of the formats, each in a file of its own.
//
// cameras.txt, images.txt and points3D.txt, COLMAP's text format. Pixels are COLMAP's: (0.5, 0.5)
// is the centre of the top-left pixel. A camera whose distortion is centred on its principal point
// is exported as OPENCV with the photos' own pixels. One with another centre, which COLMAP cannot
// express, is exported as PINHOLE with undistorted pixels.
std::unique_ptr<Exporter> MakeColmapExporter(const Snapshot& snapshot, const ExportRequest&);
// The same in COLMAP's binary format: cameras.bin, images.bin and points3D.bin.
std::unique_ptr<Exporter> MakeColmapBinaryExporter(const Snapshot& snapshot, const ExportRequest&);
// images/ with undistorted photos, as PNG files, and sparse/0/ with the binary model of pinhole
// cameras that took them: the folder that COLMAP's image_undistorter makes, and from which trainers
// of splats start.
std::unique_ptr<Exporter> MakeColmapUndistortedExporter(const Snapshot& snapshot,
                                                        const ExportRequest&);
// scene.mvs of OpenMVS with images/, undistorted photos as PNG files. Holds all points.
std::unique_ptr<Exporter> MakeOpenMvsExporter(const Snapshot& snapshot, const ExportRequest&);
// transforms.json, points.ply and images/, as nerfstudio and trainers of splats read them: photos
// undistorted, as PNG files, each with its camera; the camera's axes are OpenGL's (x right, y up, z
// backward), the world is the reconstruction's. Pixels are COLMAP's. Holds one photo at a time.
std::unique_ptr<Exporter> MakeNerfstudioExporter(const Snapshot& snapshot, const ExportRequest&);
// points.ply; mesh.ply where there is a surface; cameras.json and cameras.ply (pyramids). Holds the
// sparse points and one tile at a time.
std::unique_ptr<Exporter> MakePlyExporter(const Snapshot& snapshot, const ExportRequest& request);
// model.glb with all of it, y up. Holds as much as the PLY exporter.
std::unique_ptr<Exporter> MakeGltfExporter(const Snapshot& snapshot, const ExportRequest& request);

}  // namespace veduta
