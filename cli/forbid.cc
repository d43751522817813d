// SPDX-License-Identifier: Apache-2.0
// veduta forbid DB A B [--reconstructions] [--by WHO] [--reason TEXT]
// veduta forbid DB PHOTO --pose [--by WHO] [--reason TEXT]
// veduta allow DB A B [--reconstructions] [--by WHO] [--reason TEXT]
// veduta allow DB PHOTO --pose [--by WHO] [--reason TEXT]
// veduta forbidden DB [--json]
#include "cli/beside_daemon.h"
#include "cli/command.h"
#include "cli/wire/removal_json.h"

namespace veduta {
namespace {

struct ForbidArguments {
  std::string db;
  ForbidRequest request;
  bool reconstructions = false, pose = false;
};

int State(ForbidArguments arguments, bool allows) {
  if (arguments.reconstructions) arguments.request.kind = ForbidKind::kMerge;
  if (arguments.pose) arguments.request.kind = ForbidKind::kPose;
  if (const Status usage = arguments.request.Check(); !usage.ok()) return FailUsage(usage);
  if (auto daemon = DaemonClient::Connect(arguments.db))
    return StateBeside(&*daemon, arguments.request, allows);
  const auto engine = OpenToWrite(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const Status stated =
      allows ? (*engine)->Allow(arguments.request) : (*engine)->Forbid(arguments.request);
  return stated.ok() ? kDone : Fail(stated);
}

std::string Text(const ForbiddenAnswer& forbidden) {
  const std::string reason = forbidden.reason.empty() ? "" : ": " + Printable(forbidden.reason);
  const std::string who = " (" + Printable(forbidden.actor) + reason + ")";
  if (forbidden.kind == ForbidKind::kMerge) {
    return "reconstructions " + std::to_string(forbidden.reconstruction_a.value) + " and " +
           std::to_string(forbidden.reconstruction_b.value) + " are not merged" + who;
  }
  const auto photo = [](const std::string& name, ImageId id) {
    return Printable(name) + " (#" + std::to_string(id.value) + ")";
  };
  const std::string a = photo(forbidden.name_a, forbidden.image_a);
  if (forbidden.kind == ForbidKind::kPose) return a + " has no pose" + who;
  return a + " and " + photo(forbidden.name_b, forbidden.image_b) + " do not show the same place" +
         who;
}

int List(const std::string& db, bool json) {
  const auto engine = OpenToRead(db);
  if (!engine.ok()) return Fail(engine.status());
  const auto all = (*engine)->Ask().Forbidden();
  if (!all.ok()) return Fail(all.status());
  if (json) {
    PrintJson(ToJson(*all));
    return kDone;
  }
  for (const ForbiddenAnswer& forbidden : *all) PrintLine("%s", Text(forbidden).c_str());
  return kDone;
}

void RegisterStatement(CLI::App* app, const char* name, const char* help, bool allows,
                       int* exit_code) {
  auto arguments = std::make_shared<ForbidArguments>();
  CLI::App* command = app->add_subcommand(name, help);
  command->add_option("DB", arguments->db, "Database")->required();
  command->add_option("A", arguments->request.a, kPhotoHelp)->required();
  command->add_option("B", arguments->request.b, "The other one; none with --pose");
  CLI::Option* const reconstructions =
      command->add_flag("--reconstructions", arguments->reconstructions,
                        "A and B are numbers of reconstructions, which must not be merged");
  command->add_flag("--pose", arguments->pose, "A is a photo that must not have a pose")
      ->excludes(reconstructions);
  command->add_option("--by", arguments->request.actor, "Who says so")->capture_default_str();
  command->add_option("--reason", arguments->request.reason, "Why, for people");
  command->callback([=] { *exit_code = State(*arguments, allows); });
}

}  // namespace

void RegisterForbid(CLI::App* app, int* exit_code) {
  RegisterStatement(app, "forbid",
                    "State that two photos do not show the same place, or that a pose is wrong",
                    /*allows=*/false, exit_code);
  RegisterStatement(app, "allow", "Take back what `forbid` has stated", /*allows=*/true, exit_code);
  auto db = std::make_shared<std::string>();
  auto json = std::make_shared<bool>(false);
  CLI::App* list = app->add_subcommand("forbidden", "What people have forbidden");
  list->add_option("DB", *db, "Database")->required();
  list->add_flag("--json", *json, "JSON");
  list->callback([=] { *exit_code = List(*db, *json); });
}

}  // namespace veduta
