// SPDX-License-Identifier: Apache-2.0
// veduta token create DB NAME --role ROLE [--days N] [--photos-per-day N] [--bytes-per-day N]
// [--requests-per-second N] [--by WHO] [--json]
// veduta token link DB NAME [--contribution NUMBER | --reconstruction NUMBER] [--days N] [--at URL]
// [--by WHO] [--json]
// veduta token list DB [--json]
// veduta token revoke DB NUMBER [--by WHO]
#include <ctime>

#include "cli/beside_daemon.h"
#include "cli/command.h"
#include "cli/wire/token_json.h"

namespace veduta {
namespace {

constexpr int64_t kDayS = 24 * 60 * 60;

struct TokenArguments {
  std::string db, role = "viewer";
  TokenRequest request;
  std::string at = "http://127.0.0.1:8484";
  uint32_t days = 0, link_days = 7, number = 0;
  bool json = false;
};

// The token, by the daemon where there is one.
Result<NewToken> Make(const TokenArguments& arguments, const TokenRequest& request) {
  if (auto daemon = DaemonClient::Connect(arguments.db)) return MakeTokenBeside(&*daemon, request);
  VEDUTA_ASSIGN_OR_RETURN(const auto engine, OpenToWrite(arguments.db));
  return engine->CreateToken(request);
}

int Create(const TokenArguments& arguments) {
  TokenRequest request = arguments.request;
  const Result<Role> role = ParseRole(arguments.role);
  if (!role.ok()) return FailUsage(role.status());
  request.role = *role;
  if (arguments.days > 0) request.expires_unix_s = std::time(nullptr) + kDayS * arguments.days;
  if (const Status usage = request.Check(); !usage.ok()) return FailUsage(usage);
  const Result<NewToken> made = Make(arguments, request);
  if (!made.ok()) return Fail(made.status());
  if (arguments.json) {
    PrintJson(ToJson(*made));
  } else {
    PrintLine("%s", Printable(made->text).c_str());
  }
  return kDone;
}

int Link(const TokenArguments& arguments) {
  TokenRequest request = arguments.request;
  request.is_link = true;
  request.expires_unix_s = std::time(nullptr) + kDayS * arguments.link_days;
  if (const Status usage = request.Check(); !usage.ok()) return FailUsage(usage);
  const Result<NewToken> made = Make(arguments, request);
  if (!made.ok()) return Fail(made.status());
  if (arguments.json) {
    PrintJson(LinkJson(*made));
  } else {
    PrintLine("%s", Printable(arguments.at + LinkPath(made->text)).c_str());
  }
  return kDone;
}

// "2026-11-26"; what is 0 never was.
std::string DayOf(int64_t time_unix_s) {
  const std::time_t time = time_unix_s;
  std::tm parts{};
  char text[32];
  if (gmtime_r(&time, &parts) == nullptr || std::strftime(text, sizeof(text), "%F", &parts) == 0)
    return std::to_string(time_unix_s);
  return text;
}

void PrintToken(const TokenAnswer& token) {
  std::string fate;
  if (token.expires_unix_s != 0) fate += ", until " + DayOf(token.expires_unix_s);
  if (token.quota.photos_per_day != 0)
    fate += ", " + std::to_string(token.quota.photos_per_day) + " photos a day";
  if (token.quota.bytes_per_day != 0)
    fate += ", " + std::to_string(token.quota.bytes_per_day) + " bytes a day";
  if (token.quota.requests_per_s != 0)
    fate += ", " + std::to_string(token.quota.requests_per_s) + " requests a second";
  if (token.contribution != 0) fate += ", for contribution " + std::to_string(token.contribution);
  if (token.reconstruction != 0)
    fate += ", for reconstruction " + std::to_string(token.reconstruction);
  if (token.revoked_unix_s != 0) fate += ", revoked on " + DayOf(token.revoked_unix_s);
  PrintLine("%4u  %-11s  %s, made on %s%s", token.number,
            token.is_link ? "link" : RoleWord(token.role).c_str(), Printable(token.name).c_str(),
            DayOf(token.created_unix_s).c_str(), fate.c_str());
}

int List(const TokenArguments& arguments) {
  const auto engine = OpenToRead(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const auto tokens = (*engine)->Ask().Tokens();
  if (!tokens.ok()) return Fail(tokens.status());
  if (arguments.json) {
    PrintJson(ToJson(*tokens));
    return kDone;
  }
  for (const TokenAnswer& token : *tokens) PrintToken(token);
  return kDone;
}

int Revoke(const TokenArguments& arguments) {
  if (auto daemon = DaemonClient::Connect(arguments.db))
    return RevokeTokenBeside(&*daemon, arguments.number, arguments.request.actor);
  const auto engine = OpenToWrite(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const Status revoked = (*engine)->RevokeToken(arguments.number, arguments.request.actor);
  return revoked.ok() ? kDone : Fail(revoked);
}

CLI::App* RegisterOne(CLI::App* group, const char* name, const char* help,
                      const std::shared_ptr<TokenArguments>& arguments,
                      int (*run)(const TokenArguments&), int* exit_code) {
  CLI::App* command = group->add_subcommand(name, help);
  command->add_option("DB", arguments->db, "Database")->required();
  command->callback([=] { *exit_code = run(*arguments); });
  return command;
}

}  // namespace

void RegisterToken(CLI::App* app, int* exit_code) {
  CLI::App* group = app->add_subcommand("token", "Tokens, by which the daemon knows who asks");
  group->require_subcommand(1);
  auto arguments = std::make_shared<TokenArguments>();
  CLI::App* create =
      RegisterOne(group, "create", "Make a token, and print it: it is told this once", arguments,
                  Create, exit_code);
  create->add_option("NAME", arguments->request.name, "Whose it is, for the journal")->required();
  create
      ->add_option("--role", arguments->role,
                   "viewer: asks; contributor: sends photos, too; curator: takes out and forbids, "
                   "too; admin: makes and revokes tokens, too")
      ->capture_default_str();
  create->add_option("--days", arguments->days, "Good for so many days (default: for ever)")
      ->check(CLI::Range(1, 36'500));
  TokenQuota* const quota = &arguments->request.quota;
  create->add_option("--photos-per-day", quota->photos_per_day,
                     "Photos that may be sent with it (default: what the daemon gives to each)");
  create->add_option("--bytes-per-day", quota->bytes_per_day, "Bytes of these photos")
      ->transform(SizeInBytes());
  create->add_option("--requests-per-second", quota->requests_per_s,
                     "Requests that may be made with it");
  create->add_flag("--json", arguments->json, "JSON");
  CLI::App* link =
      RegisterOne(group, "link",
                  "Make a link that lets whoever has it read, and print it: it is told this once",
                  arguments, Link, exit_code);
  link->add_option("NAME", arguments->request.name, "Whom or what it is for, for the journal")
      ->required();
  link->add_option("--days", arguments->link_days, "Good for so many days")
      ->capture_default_str()
      ->check(CLI::Range(1, 366));
  CLI::Option* const contribution =
      link->add_option("--contribution", arguments->request.contribution,
                       "It shows the photos of this contribution alone");
  link->add_option("--reconstruction", arguments->request.reconstruction,
                   "It shows this reconstruction alone")
      ->excludes(contribution);
  link->add_option("--at", arguments->at, "The daemon's address, as those who get the link see it")
      ->capture_default_str();
  link->add_flag("--json", arguments->json, "JSON");
  CLI::App* list = RegisterOne(group, "list", "All tokens that were made; none can be told again",
                               arguments, List, exit_code);
  list->add_flag("--json", arguments->json, "JSON");
  CLI::App* revoke = RegisterOne(group, "revoke", "A token is good for nothing from now on",
                                 arguments, Revoke, exit_code);
  revoke->add_option("NUMBER", arguments->number, "Its number, as `list` has it")->required();
  for (CLI::App* const command : {create, link, revoke})
    command->add_option("--by", arguments->request.actor, "Who does it, for the journal")
        ->capture_default_str();
}

}  // namespace veduta
