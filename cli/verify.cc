// SPDX-License-Identifier: Apache-2.0
// veduta verify DB; veduta digest DB
#include "cli/command.h"
#include "engine/query/digest.h"
#include "engine/query/invariants.h"
#include "fusion/pass/dense_invariants.h"

namespace veduta {
namespace {

constexpr size_t kViolationsShownMax = 1000;

int Verify(const std::string& db) {
  // Opened for writing: what a crash left half-written is swept first, as any `add` would.
  const auto engine = OpenToWrite(db);
  if (!engine.ok()) return Fail(engine.status());
  auto violations = FindViolations((*engine)->Ask().snapshot(), kViolationsShownMax);
  if (!violations.ok()) return Fail(violations.status());
  const auto dense =
      FindDenseViolations((*engine)->Ask().snapshot(), kViolationsShownMax - violations->size());
  if (!dense.ok()) return Fail(dense.status());
  violations->insert(violations->end(), dense->begin(), dense->end());
  for (const std::string& violation : *violations) std::printf("%s\n", violation.c_str());
  if (violations->empty()) std::printf("sound\n");
  return violations->empty() ? kDone : kDatabaseUnusable;
}

int Digest(const std::string& db) {
  const auto engine = OpenToRead(db);
  if (!engine.ok()) return Fail(engine.status());
  const auto digest = DigestOf((*engine)->Ask().snapshot());
  if (!digest.ok()) return Fail(digest.status());
  std::printf("%s\n", digest->Hex().c_str());
  return kDone;
}

void RegisterPlain(CLI::App* app, const char* name, const char* help,
                   int (*run)(const std::string&), int* exit_code) {
  auto db = std::make_shared<std::string>();
  CLI::App* command = app->add_subcommand(name, help);
  command->add_option("DB", *db, "Database")->required();
  command->callback([=] { *exit_code = run(*db); });
}

}  // namespace

void RegisterVerify(CLI::App* app, int* exit_code) {
  RegisterPlain(app, "verify", "Check every invariant; a line a violation", Verify, exit_code);
}

void RegisterDigest(CLI::App* app, int* exit_code) {
  RegisterPlain(app, "digest", "One hash over the logical content: equal for equal cities", Digest,
                exit_code);
}

}  // namespace veduta
