// SPDX-License-Identifier: Apache-2.0
// veduta journal DB [--from N] [--json]; veduta backup DB OUT
#include "cli/command.h"
#include "cli/wire/answers_json.h"

namespace veduta {
namespace {

// Entries that are held in memory at once. Chosen by hand, not measured.
constexpr uint32_t kEntriesAtOnce = 1000;

int PrintJournal(const std::string& db, uint64_t first) {
  const auto engine = OpenToRead(db);
  if (!engine.ok()) return Fail(engine.status());
  const Questions ask = (*engine)->Ask();
  while (true) {
    const auto entries = ask.Journal(first, kEntriesAtOnce);
    if (!entries.ok()) return Fail(entries.status());
    for (const JournalAnswer& entry : *entries) PrintJson(ToJson(entry));
    if (entries->size() < kEntriesAtOnce) return kDone;
    first = entries->back().sequence + 1;
  }
}

int Backup(const std::string& db, const std::string& out) {
  const auto engine = OpenToWrite(db);
  if (!engine.ok()) return Fail(engine.status());
  const Status copied = (*engine)->Backup(out);
  return copied.ok() ? kDone : Fail(copied);
}

}  // namespace

void RegisterJournal(CLI::App* app, int* exit_code) {
  auto db = std::make_shared<std::string>();
  auto first = std::make_shared<uint64_t>(1);
  CLI::App* command =
      app->add_subcommand("journal", "What was done, by whom: one JSON object per line");
  command->add_option("DB", *db, "Database")->required();
  command->add_option("--from", *first, "First sequence number");
  command->add_flag("--json")->description("JSON, which it is in any case");
  command->callback([=] { *exit_code = PrintJournal(*db, *first); });
}

void RegisterBackup(CLI::App* app, int* exit_code) {
  auto db = std::make_shared<std::string>();
  auto out = std::make_shared<std::string>();
  CLI::App* command =
      app->add_subcommand("backup", "A consistent copy that can be opened on its own");
  command->add_option("DB", *db, "Database")->required();
  command->add_option("OUT", *out, "Folder to make")->required();
  command->callback([=] { *exit_code = Backup(*db, *out); });
}

}  // namespace veduta
