// SPDX-License-Identifier: Apache-2.0
// veduta export DB OUT --format FORMAT [--error E]
//   [--on-earth] [--with-hidden] [--json]
#include "cli/command.h"
#include "cli/wire/dense_json.h"
#include "engine/door/turned_photos.h"

namespace veduta {
namespace {

struct ExportArguments {
  std::string db;
  ExportRequest request;
  bool json = false;
};

void PrintModel(const ExportedModel& model) {
  std::string surface;
  if (model.triangles > 0) {
    surface = ", " + std::to_string(model.vertices) + " vertices, " +
              std::to_string(model.triangles) + " triangles";
  } else if (model.may_have_surface) {
    surface = ", no surface yet: 'veduta densify' makes one";
  }
  PrintLine("%s: reconstruction %u, %lu images, %lu points%s%s", Printable(model.folder).c_str(),
            model.reconstruction.value, model.images, model.points, surface.c_str(),
            model.on_earth ? ", on the earth" : "");
}

// COLMAP has no lens with a centre of distortion of its own: what stands in such a model is
// undistorted, and the photos are not.
Status WarnOfLenses(const Questions& ask) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<CameraAnswer> cameras, ask.Cameras());
  for (const CameraAnswer& camera : cameras) {
    const CameraModel& model = camera.model;
    const bool is_distorted = model.k1 != 0 || model.k2 != 0;
    if (!is_distorted || (model.u0 == model.cx && model.v0 == model.cy)) continue;
    std::fprintf(stderr,
                 "veduta: warning: COLMAP cannot express the lens of camera '%s', so the model has "
                 "it undistorted, and the photos are not: to work with these, too, export with "
                 "--format colmap-undistorted\n",
                 Printable(camera.name).c_str());
  }
  return Status::Ok();
}

// COLMAP takes the pixels of a file as they are, whatever its EXIF says, and stops at a photo whose
// sides are not those of its camera.
Status WarnOfTurned(const Questions& ask) {
  VEDUTA_ASSIGN_OR_RETURN(const TurnedPhotos turned, FindTurnedPhotos(ask));
  if (turned.count == 0) return Status::Ok();
  std::fprintf(stderr,
               "veduta: warning: COLMAP does not turn photos as their EXIF asks, and the model has "
               "%lu turned ones, the first of them '%s': to work with the pictures, export with "
               "--format colmap-undistorted\n",
               turned.count, Printable(turned.first).c_str());
  return Status::Ok();
}

int Export(const ExportArguments& arguments) {
  if (const Status usage = arguments.request.Check(); !usage.ok()) return FailUsage(usage);
  const auto engine = OpenToRead(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const auto models = (*engine)->Ask().Export(arguments.request);
  if (!models.ok()) return Fail(models.status());
  if (arguments.request.format == "colmap" || arguments.request.format == "colmap-binary") {
    const Status warned = WarnOfLenses((*engine)->Ask());
    if (!warned.ok()) return Fail(warned);
    if (const Status told = WarnOfTurned((*engine)->Ask()); !told.ok()) return Fail(told);
  }
  for (const ExportedModel& model : *models) {
    if (arguments.json) {
      PrintJson(ToJson(model));
    } else {
      PrintModel(model);
    }
    if (arguments.request.on_earth && !model.on_earth)
      std::fprintf(stderr, "veduta: warning: %s is not on the earth, for its place is not known\n",
                   Printable(model.folder).c_str());
  }
  return kDone;
}

}  // namespace

void RegisterExport(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<ExportArguments>();
  arguments->request.format = "colmap";
  CLI::App* command =
      app->add_subcommand("export", "Write the reconstructions for other programs, largest first");
  command->add_option("DB", arguments->db, "Database")->required();
  command->add_option("OUT", arguments->request.folder, "Folder to make")->required();
  command
      ->add_option("--format", arguments->request.format,
                   "colmap, colmap-binary: a model per folder, as text or binary; "
                   "colmap-undistorted: with undistorted photos, for trainers of splats; "
                   "nerfstudio: transforms.json with undistorted photos and points; openmvs: "
                   "scene.mvs with undistorted photos; ply: points, mesh, cameras; gltf: all in "
                   "one model.glb")
      ->check(CLI::IsMember(ExportFormats()));
  command->add_flag("--on-earth", arguments->request.on_earth,
                    "ply and gltf: metres to the east, the north and above an origin, which "
                    "earth.json names, where the place of a reconstruction is known");
  command
      ->add_option(
          "--error", arguments->request.error_max,
          "Fewer triangles: the surface may move by so much, in the reconstruction's units")
      ->check(AboveZero());
  command->add_flag("--with-hidden", arguments->request.with_hidden,
                    "With photos that a curator has hidden: their names, poses and pictures");
  command->add_flag("--json", arguments->json, "One JSON object per reconstruction");
  command->callback([=] { *exit_code = Export(*arguments); });
}

}  // namespace veduta
