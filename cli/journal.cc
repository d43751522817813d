// SPDX-License-Identifier: Apache-2.0
// veduta journal DB [--from N] [--json]
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

}  // namespace veduta
