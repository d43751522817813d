// SPDX-License-Identifier: Apache-2.0
// veduta verify DB [--deep] [--json]; veduta digest DB [--json]
#include "cli/command.h"
#include "cli/wire/answers_json.h"

namespace veduta {
namespace {

// A database that breaks more invariants is no better understood by more lines. Chosen by hand.
constexpr uint32_t kViolationsShownMax = 1000;

struct Options {
  std::string db;
  bool deep = false, json = false;
};

int Verify(const Options& options) {
  // Opened for reading: others may write meanwhile. What a crash left half-written is no violation;
  // the next `add` deletes it.
  const auto engine = OpenToRead(options.db);
  if (!engine.ok()) return Fail(engine.status());
  const auto violations =
      (*engine)->Ask().Verify({.count_max = kViolationsShownMax, .deep = options.deep});
  if (!violations.ok()) return Fail(violations.status());
  if (options.json) {
    PrintJson(ViolationsJson(*violations));
  } else {
    for (const std::string& violation : *violations) {
      PrintLine("%s", Printable(violation).c_str());
    }
    if (violations->empty()) PrintLine("sound");
  }
  return violations->empty() ? kDone : kDatabaseUnusable;
}

int Digest(const Options& options) {
  const auto engine = OpenToRead(options.db);
  if (!engine.ok()) return Fail(engine.status());
  const Result<std::string> digest = (*engine)->Ask().Digest();
  if (!digest.ok()) return Fail(digest.status());
  if (options.json) {
    PrintJson(DigestJson(*digest));
  } else {
    PrintLine("%s", digest->c_str());
  }
  return kDone;
}

CLI::App* RegisterOne(CLI::App* app, const char* name, const char* help,
                      const std::shared_ptr<Options>& options, int (*run)(const Options&),
                      int* exit_code) {
  CLI::App* command = app->add_subcommand(name, help);
  command->add_option("DB", options->db, "Database")->required();
  command->add_flag("--json", options->json, "JSON");
  command->callback([=] { *exit_code = run(*options); });
  return command;
}

}  // namespace

void RegisterVerify(CLI::App* app, int* exit_code) {
  const auto options = std::make_shared<Options>();
  RegisterOne(app, "verify", "Check every invariant; one line per violation", options, Verify,
              exit_code)
      ->add_flag("--deep", options->deep,
                 "Also compare the checksums of all files, and derive features and words again");
}

void RegisterDigest(CLI::App* app, int* exit_code) {
  RegisterOne(app, "digest", "One hash over the logical content: equal for equal cities",
              std::make_shared<Options>(), Digest, exit_code);
}

}  // namespace veduta
