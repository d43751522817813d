// SPDX-License-Identifier: Apache-2.0
// veduta report DB PHOTO REASON [--text TEXT] [--by WHO]
// veduta reports DB [--all] [--json]
// veduta dismiss DB NUMBER [--by WHO]
#include "cli/command.h"
#include "cli/daemon_json.h"
#include "cli/wire/moderation_json.h"

namespace veduta {
namespace {

void PrintReport(const ReportAnswer& report) {
  const std::string photo =
      report.name.empty() ? "a photo that was removed" : Printable(report.name);
  const std::string text = report.text.empty() ? "" : ": " + Printable(report.text);
  const std::string fate =
      report.state == ReportState::kOpen
          ? ""
          : ", " + ReportStateWord(report.state) + " by " + Printable(report.resolver);
  PrintLine("%4u  %s (#%u)  %s, by %s%s%s", report.number, photo.c_str(), report.image.value,
            ReportReasonWord(report.reason).c_str(), Printable(report.reporter).c_str(),
            fate.c_str(), text.c_str());
}

int List(const std::string& db, bool all, bool json) {
  const auto engine = OpenToRead(db);
  if (!engine.ok()) return Fail(engine.status());
  const auto reports = (*engine)->Ask().Reports(/*open_only=*/!all);
  if (!reports.ok()) return Fail(reports.status());
  if (json) {
    PrintJson(ToJson(*reports));
    return kDone;
  }
  for (const ReportAnswer& report : *reports) PrintReport(report);
  return kDone;
}

int Dismiss(const std::string& db, uint32_t number, const std::string& actor) {
  if (auto daemon = DaemonClient::Connect(db)) {
    const Status done =
        Post(&*daemon, "/v1/reports/" + std::to_string(number) + "/dismiss", Json{{"actor", actor}})
            .status();
    return done.ok() ? kDone : Fail(done);
  }
  const auto engine = OpenToWrite(db);
  if (!engine.ok()) return Fail(engine.status());
  const Status done = (*engine)->DismissReport(number, actor);
  return done.ok() ? kDone : Fail(done);
}

Status ReportBeside(DaemonClient* daemon, const ReportRequest& report) {
  const Json wanted = {{"reason", ReportReasonWord(report.reason)},
                       {"text", report.text},
                       {"reporter", report.reporter}};
  return Post(daemon, "/v1/photos/" + EncodeForQuery(report.photo) + "/report", wanted).status();
}

int Report(const std::string& db, ReportRequest report, const std::string& reason) {
  const Result<ReportReason> parsed = ParseReportReason(reason);
  if (!parsed.ok()) return FailUsage(parsed.status());
  report.reason = *parsed;
  if (const Status usage = report.Check(); !usage.ok()) return FailUsage(usage);
  if (auto daemon = DaemonClient::Connect(db)) {
    const Status done = ReportBeside(&*daemon, report);
    return done.ok() ? kDone : Fail(done);
  }
  const auto engine = OpenToWrite(db);
  if (!engine.ok()) return Fail(engine.status());
  const auto number = (*engine)->Report(report);
  return number.ok() ? kDone : Fail(number.status());
}

struct ReportsArguments {
  std::string db, actor = "anonymous", reason;
  ReportRequest report;
  uint32_t number = 0;
  bool all = false, json = false;
};

}  // namespace

void RegisterReports(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<ReportsArguments>();
  arguments->report.reporter = arguments->actor;
  CLI::App* report =
      app->add_subcommand("report", "Tell curators that something is wrong with a photo");
  report->add_option("DB", arguments->db, "Database")->required();
  report->add_option("PHOTO", arguments->report.photo, kPhotoHelp)->required();
  report->add_option("REASON", arguments->reason, "privacy, copyright, offensive, wrong or other")
      ->required();
  report->add_option("--text", arguments->report.text, "For the curators");
  report->add_option("--by", arguments->report.reporter, "Who reports it")->capture_default_str();
  report->callback(
      [=] { *exit_code = Report(arguments->db, arguments->report, arguments->reason); });
  CLI::App* list = app->add_subcommand(
      "reports", "Photos that people have reported; `hide` and `remove` resolve their reports");
  list->add_option("DB", arguments->db, "Database")->required();
  list->add_flag("--all", arguments->all, "Also those that were resolved");
  list->add_flag("--json", arguments->json, "JSON");
  list->callback([=] { *exit_code = List(arguments->db, arguments->all, arguments->json); });
  CLI::App* dismiss = app->add_subcommand("dismiss", "A reported photo stays as it is");
  dismiss->add_option("DB", arguments->db, "Database")->required();
  dismiss->add_option("NUMBER", arguments->number, "The report's, as `reports` has it")->required();
  dismiss->add_option("--by", arguments->actor, "Who does it")->capture_default_str();
  dismiss->callback(
      [=] { *exit_code = Dismiss(arguments->db, arguments->number, arguments->actor); });
}

}  // namespace veduta
