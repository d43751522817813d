// SPDX-License-Identifier: Apache-2.0
// veduta journal DB [--from N]; veduta backup DB OUT
#include "cli/command.h"

namespace veduta {

void RegisterJournal(CLI::App* app, int* exit_code) {
  auto db = std::make_shared<std::string>();
  auto first = std::make_shared<uint64_t>(1);
  CLI::App* command =
      app->add_subcommand("journal", "What was done, by whom, a JSON object a line");
  command->add_option("DB", *db, "Database")->required();
  command->add_option("--from", *first, "First sequence number");
  command->callback([=] {
    const auto engine = OpenToRead(*db);
    if (!engine.ok()) {
      *exit_code = Fail(engine.status());
      return;
    }
    const Status scanned =
        (*engine)->Ask().snapshot().ScanJournal(*first, [](const JournalRecord& r) {
          const nlohmann::ordered_json line = {
              {"sequence", r.sequence},   {"time", r.time_unix_s},
              {"actor", r.actor},         {"action", r.action},
              {"image", ToJson(r.image)}, {"reconstruction", ToJson(r.reconstruction)},
              {"detail", r.detail}};
          std::printf(
              "%s\n",
              line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace).c_str());
          return true;
        });
    if (!scanned.ok()) *exit_code = Fail(scanned);
  });
}

void RegisterBackup(CLI::App* app, int* exit_code) {
  auto db = std::make_shared<std::string>();
  auto out = std::make_shared<std::string>();
  CLI::App* command =
      app->add_subcommand("backup", "A consistent copy that can be opened on its own");
  command->add_option("DB", *db, "Database")->required();
  command->add_option("OUT", *out, "Folder to make")->required();
  command->callback([=] {
    const auto engine = OpenToWrite(*db);
    const Status copied =
        engine.ok() ? (*engine)->database()->CreateCheckpoint(*out) : engine.status();
    if (!copied.ok()) *exit_code = Fail(copied);
  });
}

}  // namespace veduta
