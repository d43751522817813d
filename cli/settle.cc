// SPDX-License-Identifier: Apache-2.0
// veduta settle DB [--threads N] [--json]
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "cli/command.h"
#include "cli/follow_ups.h"
#include "cli/owner_beside.h"
#include "cli/stop_on_signal.h"
#include "cli/wire/added_json.h"

namespace veduta {
namespace {

struct SettleArguments {
  std::string db;
  uint32_t threads = 0;
  bool json = false;
};

using Failures = std::vector<std::pair<std::string, Status>>;  // with the photo's name

// Photos that a daemon has taken, and that it has not placed: how many are, and why others are not.
Result<size_t> PlaceOnce(Engine* engine, bool json, const std::stop_token& stop,
                         Failures* failures) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<UploadAnswer> uploads, engine->Ask().Uploads());
  std::vector<std::pair<const UploadAnswer*, Ticket>> tickets;
  for (const UploadAnswer& upload : uploads) {
    Result<Ticket> ticket = engine->Resume(upload.number);
    if (ticket.status().code() == StatusCode::kNotFound) continue;  // it has had its turn
    VEDUTA_RETURN_IF_ERROR(ticket.status());
    tickets.emplace_back(&upload, std::move(*ticket));
  }
  failures->clear();
  for (const auto& [upload, ticket] : tickets) {
    if (stop.stop_requested()) return Status::Cancelled("stopped before all photos were placed");
    const Result<AddOutcome> outcome = ticket.Wait();
    if (!outcome.ok()) {
      failures->emplace_back(upload->name, outcome.status());
    } else if (json) {
      PrintJson(ToJson(*outcome));
    } else {
      PrintLine("%-10s %s: %s", OutcomeWord(*outcome).c_str(), Printable(upload->name).c_str(),
                Printable(OutcomeReason(*outcome)).c_str());
    }
  }
  return tickets.size() - failures->size();
}

bool AwaitsCamera(const Failures::value_type& failed) {
  return failed.second.code() == StatusCode::kNotFound;
}

// The same, until no photo that waits for its camera gets one any more: those wait on, and are no
// failure.
Status PlaceUploads(Engine* engine, bool json, const std::stop_token& stop) {
  Failures failures;
  for (bool is_first = true;; is_first = false) {
    VEDUTA_ASSIGN_OR_RETURN(const size_t placed, PlaceOnce(engine, json, stop, &failures));
    if (std::ranges::none_of(failures, AwaitsCamera) || (placed == 0 && !is_first)) break;
    VEDUTA_ASSIGN_OR_RETURN(const auto cameras, engine->CalibrateWaiting(stop));
    for (const FirstCamera& camera : cameras)
      std::fprintf(stderr, "veduta: %s\n", Printable(FirstCameraText(ToJson(camera))).c_str());
  }
  Status failure;
  for (const auto& failed : failures) {
    std::fprintf(stderr, "veduta: %s: %s\n", Printable(failed.first).c_str(),
                 Printable(failed.second.message()).c_str());
    if (!AwaitsCamera(failed)) failure = failed.second;
  }
  return failure;
}

// What a step has done, or why it failed.
void Tell(const FollowUp& step, const Questions& ask, const SettleArguments& arguments) {
  if (arguments.json) {
    PrintJson(ToJson(step));
  } else if (step.status.ok()) {
    PrintLine("done: %s", FollowUpText(step, ask).c_str());
    if (step.merged_into.valid()) PrintLine("%-10s %s", "  then", JoinedText(step).c_str());
    PrintHealed(step.unplaced, step.split_off, ask);
    PrintPlacedLater(step.placed, ask);
  }
  if (!step.status.ok())
    std::fprintf(stderr, "%s\n", FollowUpFailure(step, ask, arguments.db).c_str());
}

int EndWith(const Status& placed, const Status& settled) {
  if (!placed.ok()) return Fail(placed);
  return settled.ok() ? kDone : Fail(settled);
}

int SettleByDaemon(DaemonClient* daemon, const SettleArguments& arguments) {
  WarnOfThreads(arguments.threads);
  const Status calibrated = CalibrateBeside(daemon, [](const std::string& camera) {
    std::fprintf(stderr, "veduta: %s\n", Printable(camera).c_str());
  });
  if (!calibrated.ok()) return Fail(calibrated);
  const Status placed = WaitForUploads(daemon, [&](const Json& outcome) {
    if (arguments.json) return PrintJson(outcome);
    PrintLine("%-10s %s: %s", Printable(outcome.value("verdict", "")).c_str(),
              Printable(outcome.value("image", "")).c_str(),
              Printable(outcome.value("reason", "")).c_str());
  });
  std::vector<FollowUp> steps;
  const Status settled = SettleBeside(daemon, [&](const FollowUp& step) { steps.push_back(step); });
  // The names of photos are asked of the database, as it is now.
  const auto engine = OpenToRead(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const Questions ask = (*engine)->Ask();
  for (const FollowUp& step : steps) Tell(step, ask, arguments);
  return EndWith(placed, settled);
}

int Settle(const SettleArguments& arguments) {
  if (auto daemon = DaemonClient::Connect(arguments.db)) return SettleByDaemon(&*daemon, arguments);
  const StopOnSignal stop;
  EngineOptions options;
  options.thread_count = arguments.threads;
  options.settle_each = true;  // photos that wait are placed as `veduta serve` places them
  const auto engine = OpenToWrite(arguments.db, options);
  if (!engine.ok()) return Fail(engine.status());
  const Status placed = PlaceUploads(engine->get(), arguments.json, stop.token());
  const Status settled = (*engine)->Settle(
      stop.token(), [&](const FollowUp& step) { Tell(step, (*engine)->Ask(), arguments); });
  return EndWith(placed, settled);
}

}  // namespace

void RegisterSettle(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<SettleArguments>();
  CLI::App* command = app->add_subcommand(
      "settle",
      "Place the photos that wait for their turn, and do all work that follows from photos");
  command->add_option("DB", arguments->db, "Database")->required();
  command->add_option("--threads", arguments->threads, "Threads (default: one per core)")
      ->check(CLI::Range(1, 1024));
  command->add_flag("--json", arguments->json,
                    "One JSON object per photo that waited, and per step");
  command->callback([=] { *exit_code = Settle(*arguments); });
}

}  // namespace veduta
