// SPDX-License-Identifier: Apache-2.0
#include "fusion/export/exporter.h"

#include <algorithm>
#include <filesystem>

#include "engine/query/living.h"
#include "fusion/export/earth_file.h"

namespace veduta {
namespace {

constexpr ExportFormat kFormats[] = {{"colmap", false, MakeColmapExporter},
                                     {"colmap-binary", false, MakeColmapBinaryExporter},
                                     {"colmap-undistorted", false, MakeColmapUndistortedExporter},
                                     {"nerfstudio", false, MakeNerfstudioExporter},
                                     {"openmvs", false, MakeOpenMvsExporter},
                                     {"ply", true, MakePlyExporter},
                                     {"gltf", true, MakeGltfExporter}};

Status MakeFolder(const std::string& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  return error ? Status::IoError("cannot make folder " + path + ": " + error.message())
               : Status::Ok();
}

}  // namespace

std::span<const ExportFormat> ListExportFormats() {
  return kFormats;
}

std::vector<std::string> ExportFormats() {
  std::vector<std::string> names;
  for (const ExportFormat& format : kFormats) names.emplace_back(format.name);
  return names;
}

Status ExportRequest::Check() const {
  if (folder.empty()) return Status::InvalidArgument("folder is empty, but must name one to make");
  if (std::ranges::none_of(kFormats, [&](const ExportFormat& f) { return format == f.name; })) {
    std::string known;
    for (const ExportFormat& f : kFormats)
      known += (known.empty() ? "" : ", ") + std::string(f.name);
    return Status::InvalidArgument("format is '" + format + "', but must be one of " + known);
  }
  if (!(error_max >= 0)) {
    return Status::InvalidArgument("error_max is " + std::to_string(error_max) +
                                   ", but must be 0 or more");
  }
  if (on_earth && format != "ply" && format != "gltf")
    return Status::InvalidArgument("on_earth is for the formats ply and gltf, not " + format);
  return Status::Ok();
}

Result<std::vector<ExportedModel>> ExportReconstructions(const Snapshot& snapshot,
                                                         const ExportRequest& request) {
  VEDUTA_RETURN_IF_ERROR(request.Check());
  const std::filesystem::path out = request.folder;
  std::error_code error;
  if (std::filesystem::exists(out, error) && !std::filesystem::is_empty(out, error)) {
    return Status::AlreadyExists(request.folder +
                                 " exists and is not empty: choose another folder");
  }
  VEDUTA_RETURN_IF_ERROR(MakeFolder(request.folder));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ReconstructionRecord> records, ListLiving(snapshot));
  const auto format = std::ranges::find_if(
      kFormats, [&](const ExportFormat& f) { return request.format == f.name; });
  const std::unique_ptr<Exporter> exporter = format->make(snapshot, request);
  std::vector<ExportedModel> models;
  for (const ReconstructionRecord& record : records) {
    const std::string folder = (out / std::to_string(models.size())).string();
    VEDUTA_RETURN_IF_ERROR(MakeFolder(folder));
    VEDUTA_ASSIGN_OR_RETURN(models.emplace_back(), exporter->Write(record, folder));
    models.back().may_have_surface = format->has_surface;
    models.back().on_earth = IsOnEarth(record, request);
    VEDUTA_RETURN_IF_ERROR(WriteEarthFile(record, request, folder + "/earth.json"));
  }
  return models;
}

}  // namespace veduta
