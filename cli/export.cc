// SPDX-License-Identifier: Apache-2.0
// veduta export DB OUT --format colmap
#include "cli/command.h"
#include "engine/colmap_export.h"

namespace veduta {

void RegisterExport(CLI::App* app, int* exit_code) {
  struct Arguments {
    std::string db, out, format = "colmap";
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app->add_subcommand("export", "Write the reconstructions for other programs, largest first");
  command->add_option("DB", arguments->db, "Database")->required();
  command->add_option("OUT", arguments->out, "Folder to make")->required();
  command->add_option("--format", arguments->format, "colmap: text model a folder")->check(CLI::IsMember({"colmap"}));
  command->callback([=] {
    const auto engine = OpenToRead(arguments->db);
    if (!engine.ok()) {
      *exit_code = Fail(engine.status());
      return;
    }
    const auto models = ExportColmap((*engine)->Ask().snapshot(), arguments->out);
    if (!models.ok()) {
      *exit_code = Fail(models.status());
      return;
    }
    for (const ExportedModel& model : *models) {
      std::printf("%s: reconstruction %u, %lu images, %lu points\n", model.folder.c_str(), model.reconstruction.value,
                  model.images, model.points);
    }
  });
}

}  // namespace veduta
