// SPDX-License-Identifier: Apache-2.0
// veduta repair DB [--yes [--rebuild]] [--threads N] [--json]
#include "cli/command.h"
#include "cli/wire/answers_json.h"

namespace veduta {
namespace {

// All of them are in the report, and in the JSON. Chosen by hand.
constexpr size_t kLinesShownMax = 50;

void PrintNames(const std::string& heading, const std::vector<std::string>& names) {
  if (names.empty()) return;
  PrintLine("%s", heading.c_str());
  for (size_t i = 0; i < names.size() && i < kLinesShownMax; ++i)
    PrintLine("  %s", Printable(names[i]).c_str());
  if (names.size() > kLinesShownMax) PrintLine("  and %zu more", names.size() - kLinesShownMax);
}

void PrintFindings(const RepairAnswer& answer) {
  for (size_t i = 0; i < answer.findings.size() && i < kLinesShownMax; ++i) {
    const RepairFinding& finding = answer.findings[i];
    PrintLine("%s", Printable(finding.damage + "; " + finding.remedy).c_str());
  }
  if (answer.findings.size() > kLinesShownMax)
    PrintLine("and %zu more", answer.findings.size() - kLinesShownMax);
  PrintNames("photos whose bytes are lost:", answer.lost);
  PrintNames("photos to be added again with their camera:", answer.written_out);
  PrintNames("photos that lost their place and are tried again:", answer.retried);
}

void PrintAnswer(const std::string& db, const RepairAnswer& answer) {
  PrintFindings(answer);
  if (answer.is_repaired) {
    if (answer.is_rebuilt) PrintLine("the map was made anew from the photos");
    if (!answer.photos_path.empty())
      PrintLine("photos to add again are in %s", Printable(answer.photos_path).c_str());
    PrintLine("the damaged database is kept as %s until you delete it",
              Printable(answer.kept_path).c_str());
    PrintLine("the report is %s", Printable(answer.report_path).c_str());
    PrintLine("repaired");
  } else if (answer.is_sound) {
    PrintLine("sound");
  } else {
    PrintLine("nothing was changed; 'veduta repair %s --yes' does this", Printable(db).c_str());
    PrintLine("if that gives no sound database, it changes nothing and asks for --rebuild");
  }
}

int Repair(const std::string& db, const RepairRequest& request, bool json) {
  const Result<RepairAnswer> answer = Engine::Repair(db, request);
  if (!answer.ok()) return Fail(answer.status());
  if (json) {
    PrintJson(ToJson(*answer));
  } else {
    PrintAnswer(db, *answer);
  }
  return answer->is_sound || answer->is_repaired ? kDone : kDatabaseUnusable;
}

}  // namespace

void RegisterRepair(CLI::App* app, int* exit_code) {
  auto db = std::make_shared<std::string>();
  auto request = std::make_shared<RepairRequest>();
  auto json = std::make_shared<bool>(false);
  CLI::App* command = app->add_subcommand(
      "repair", "Say what is damaged; with --yes, make a sound database and keep the damaged one");
  command->add_option("DB", *db, "Database")->required();
  command->add_flag("--yes", request->apply, "Do it; without, nothing is changed");
  command->add_flag("--rebuild", request->may_rebuild,
                    "With --yes: where nothing less helps, add all photos to a new database");
  command->add_option("--threads", request->thread_count, "Threads; 0: one per core");
  command->add_flag("--json", *json, "JSON");
  command->callback([=] { *exit_code = Repair(*db, *request, *json); });
}

}  // namespace veduta
