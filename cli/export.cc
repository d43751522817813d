// SPDX-License-Identifier: Apache-2.0
// veduta export DB OUT --format colmap|ply|gltf [--error E]
#include "cli/command.h"
#include "fusion/export/exporter.h"

namespace veduta {
namespace {

struct ExportArguments {
  std::string db, out, format = "colmap";
  double error_max = 0;
};

int Export(const ExportArguments& arguments) {
  const auto engine = OpenToRead(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const auto models = ExportReconstructions((*engine)->Ask().snapshot(),
                                            {arguments.out, arguments.format, arguments.error_max});
  if (!models.ok()) return Fail(models.status());
  for (const ExportedModel& model : *models) {
    std::printf("%s: reconstruction %u, %lu images, %lu points", model.folder.c_str(),
                model.reconstruction.value, model.images, model.points);
    if (arguments.format == "colmap") {
      std::printf("\n");
    } else if (model.triangles > 0) {
      std::printf(", %lu vertices, %lu triangles\n", model.vertices, model.triangles);
    } else {
      std::printf(", no surface yet: 'veduta densify' makes one\n");
    }
  }
  return kDone;
}

}  // namespace

void RegisterExport(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<ExportArguments>();
  CLI::App* command =
      app->add_subcommand("export", "Write the reconstructions for other programs, largest first");
  command->add_option("DB", arguments->db, "Database")->required();
  command->add_option("OUT", arguments->out, "Folder to make")->required();
  command
      ->add_option(
          "--format", arguments->format,
          "colmap: text model a folder; ply: points, mesh, cameras; gltf: all in one model.glb")
      ->check(CLI::IsMember({"colmap", "ply", "gltf"}));
  command
      ->add_option(
          "--error", arguments->error_max,
          "Fewer triangles: the surface may move by so much, in the reconstruction's units")
      ->check(CLI::PositiveNumber);
  command->callback([=] { *exit_code = Export(*arguments); });
}

}  // namespace veduta
