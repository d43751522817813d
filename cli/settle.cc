// SPDX-License-Identifier: Apache-2.0
// veduta settle DB [--threads N] [--json]
#include <algorithm>

#include "cli/command.h"
#include "cli/follow_ups.h"
#include "cli/stop_on_signal.h"
#include "cli/wire/added_json.h"

namespace veduta {
namespace {

struct SettleArguments {
  std::string db;
  uint32_t threads = 0;
  bool json = false;
};

int Settle(const SettleArguments& arguments) {
  const StopOnSignal stop;
  EngineOptions options;
  options.thread_count = arguments.threads;
  const auto engine = OpenToWrite(arguments.db, options);
  if (!engine.ok()) return Fail(engine.status());
  const auto followed = [&](const FollowUp& step) {
    const Questions ask = (*engine)->Ask();
    if (arguments.json) {
      PrintJson(ToJson(step));
    } else if (step.status.ok()) {
      PrintLine("done: %s", FollowUpText(step, ask).c_str());
      if (step.merged_into.valid()) PrintLine("%-10s %s", "  then", JoinedText(step).c_str());
      PrintHealed(step.unplaced, step.split_off, ask);
      PrintPlacedLater(step.placed, ask);
    }
    if (!step.status.ok()) {
      std::fprintf(stderr, "%s\n", FollowUpFailure(step, ask, arguments.db).c_str());
    }
  };
  const Status settled = (*engine)->Settle(stop.token(), followed);
  return settled.ok() ? kDone : Fail(settled);
}

}  // namespace

void RegisterSettle(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<SettleArguments>();
  CLI::App* command = app->add_subcommand(
      "settle", "Do all work that follows from the photos: an `add` that was stopped left some");
  command->add_option("DB", arguments->db, "Database")->required();
  command->add_option("--threads", arguments->threads, "Threads (default: one per core)")
      ->check(CLI::Range(1, 1024));
  command->add_flag("--json", arguments->json, "One JSON object per step");
  command->callback([=] { *exit_code = Settle(*arguments); });
}

}  // namespace veduta
