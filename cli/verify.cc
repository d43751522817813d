// SPDX-License-Identifier: Apache-2.0
// veduta verify DB [--json]; veduta digest DB [--json]
#include "cli/command.h"
#include "cli/wire/answers_json.h"

namespace veduta {
namespace {

// A database that breaks more invariants is no better understood by more lines. Chosen by hand.
constexpr uint32_t kViolationsShownMax = 1000;

int Verify(const std::string& db, bool json) {
  // Opened for writing: what a crash left half-written is swept first, as any `add` would.
  const auto engine = OpenToWrite(db);
  if (!engine.ok()) return Fail(engine.status());
  const auto violations = (*engine)->Ask().Verify(kViolationsShownMax);
  if (!violations.ok()) return Fail(violations.status());
  if (json) {
    PrintJson(ViolationsJson(*violations));
  } else {
    for (const std::string& violation : *violations) {
      PrintLine("%s", Printable(violation).c_str());
    }
    if (violations->empty()) PrintLine("sound");
  }
  return violations->empty() ? kDone : kDatabaseUnusable;
}

int Digest(const std::string& db, bool json) {
  const auto engine = OpenToRead(db);
  if (!engine.ok()) return Fail(engine.status());
  const Result<std::string> digest = (*engine)->Ask().Digest();
  if (!digest.ok()) return Fail(digest.status());
  if (json) {
    PrintJson(DigestJson(*digest));
  } else {
    PrintLine("%s", digest->c_str());
  }
  return kDone;
}

void RegisterOne(CLI::App* app, const char* name, const char* help,
                 int (*run)(const std::string& db, bool json), int* exit_code) {
  auto db = std::make_shared<std::string>();
  auto json = std::make_shared<bool>(false);
  CLI::App* command = app->add_subcommand(name, help);
  command->add_option("DB", *db, "Database")->required();
  command->add_flag("--json", *json, "JSON");
  command->callback([=] { *exit_code = run(*db, *json); });
}

}  // namespace

void RegisterVerify(CLI::App* app, int* exit_code) {
  RegisterOne(app, "verify", "Check every invariant; one line per violation", Verify, exit_code);
}

void RegisterDigest(CLI::App* app, int* exit_code) {
  RegisterOne(app, "digest", "One hash over the logical content: equal for equal cities", Digest,
              exit_code);
}

}  // namespace veduta
