// SPDX-License-Identifier: Apache-2.0
// veduta hide DB PHOTO... [--contribution NUMBER] [--by WHO] [--reason TEXT]
// veduta unhide DB PHOTO... [--contribution NUMBER] [--by WHO] [--reason TEXT]
// veduta hidden DB [--json]
#include "cli/command.h"
#include "cli/daemon_json.h"
#include "cli/wire/moderation_json.h"

namespace veduta {
namespace {

struct HideArguments {
  std::string db;
  HideRequest request;
};

Status HideBeside(DaemonClient* daemon, const HideRequest& request, bool unhides) {
  Json wanted = {{"actor", request.actor}, {"reason", request.reason}};
  if (!request.photos.empty()) wanted["photos"] = request.photos;
  if (request.contribution != 0) wanted["contribution"] = request.contribution;
  return Post(daemon, unhides ? "/v1/shown" : "/v1/hidden", wanted).status();
}

int Hide(const HideArguments& arguments, bool unhides) {
  const HideRequest& request = arguments.request;
  if (const Status usage = request.Check(); !usage.ok()) return FailUsage(usage);
  if (auto daemon = DaemonClient::Connect(arguments.db)) {
    const Status done = HideBeside(&*daemon, request, unhides);
    return done.ok() ? kDone : Fail(done);
  }
  const auto engine = OpenToWrite(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const Status done = unhides ? (*engine)->Unhide(request) : (*engine)->Hide(request);
  return done.ok() ? kDone : Fail(done);
}

std::string Text(const HiddenAnswer& hidden) {
  const std::string reason = hidden.reason.empty() ? "" : ": " + Printable(hidden.reason);
  const std::string who = " (" + Printable(hidden.actor) + reason + ")";
  const std::string number = std::to_string(hidden.number);
  if (hidden.kind == HiddenKind::kContribution) return "contribution " + number + who;
  if (hidden.name.empty()) return "#" + number + ", which was removed" + who;
  return Printable(hidden.name) + " (#" + number + ")" + who;
}

int List(const std::string& db, bool json) {
  const auto engine = OpenToRead(db);
  if (!engine.ok()) return Fail(engine.status());
  const auto all = (*engine)->Ask().Hidden();
  if (!all.ok()) return Fail(all.status());
  if (json) {
    PrintJson(ToJson(*all));
    return kDone;
  }
  for (const HiddenAnswer& hidden : *all) PrintLine("%s", Text(hidden).c_str());
  return kDone;
}

void RegisterOne(CLI::App* app, const char* name, const char* help, bool unhides, int* exit_code) {
  auto arguments = std::make_shared<HideArguments>();
  CLI::App* command = app->add_subcommand(name, help);
  command->add_option("DB", arguments->db, "Database")->required();
  command->add_option("PHOTO", arguments->request.photos, kPhotoHelp);
  command->add_option("--contribution", arguments->request.contribution,
                      "A contribution's number, with all of its photos, also those to come");
  command->add_option("--by", arguments->request.actor, "Who does it")->capture_default_str();
  command->add_option("--reason", arguments->request.reason, "Why, for curators");
  command->callback([=] { *exit_code = Hide(*arguments, unhides); });
}

}  // namespace

void RegisterHide(CLI::App* app, int* exit_code) {
  RegisterOne(app, "hide", "Show photos to curators alone; what the map has by them stays as it is",
              /*unhides=*/false, exit_code);
  RegisterOne(app, "unhide", "Take back what `hide` has hidden", /*unhides=*/true, exit_code);
  auto db = std::make_shared<std::string>();
  auto json = std::make_shared<bool>(false);
  CLI::App* list = app->add_subcommand("hidden", "What is hidden");
  list->add_option("DB", *db, "Database")->required();
  list->add_flag("--json", *json, "JSON");
  list->callback([=] { *exit_code = List(*db, *json); });
}

}  // namespace veduta
