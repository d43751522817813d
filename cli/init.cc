// SPDX-License-Identifier: Apache-2.0
// veduta init DB
#include "cli/command.h"

namespace veduta {

void RegisterInit(CLI::App* app, int* exit_code) {
  auto path = std::make_shared<std::string>();
  CLI::App* command = app->add_subcommand("init", "Make an empty database");
  command->add_option("DB", *path, "Folder to make")->required();
  command->callback([=] {
    EngineOptions options;
    options.create = true;
    const auto engine = Engine::Open(*path, options);
    *exit_code = engine.ok() ? kDone : Fail(engine.status());
  });
}

}  // namespace veduta
