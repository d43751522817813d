// SPDX-License-Identifier: Apache-2.0
// veduta vocabulary train|info DB; veduta vocabulary import|export DB FILE
#include "cli/command.h"
#include "cli/owner_beside.h"
#include "cli/wire/answers_json.h"

namespace veduta {
namespace {

struct VocabularyArguments {
  std::string db, file;
  VocabularyRequest request;
  bool json = true;  // `info` prints nothing else; the flag is there because all who answer have it
};

int Train(const VocabularyArguments& arguments) {
  if (auto daemon = DaemonClient::Connect(arguments.db)) {
    const Status done = TrainBeside(&*daemon, arguments.request);
    return done.ok() ? kDone : Fail(done);
  }
  const auto engine = OpenToWrite(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const Status trained = (*engine)->TrainVocabulary(arguments.request);
  return trained.ok() ? kDone : Fail(trained);
}

int Import(const VocabularyArguments& arguments) {
  if (auto daemon = DaemonClient::Connect(arguments.db)) {
    const Status done = ImportBeside(&*daemon, arguments.file);
    return done.ok() ? kDone : Fail(done);
  }
  const auto engine = OpenToWrite(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const Status imported = (*engine)->ImportVocabulary(arguments.file);
  return imported.ok() ? kDone : Fail(imported);
}

int Export(const VocabularyArguments& arguments) {
  const auto engine = OpenToRead(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const Status exported = (*engine)->Ask().ExportVocabulary(arguments.file);
  return exported.ok() ? kDone : Fail(exported);
}

int Info(const VocabularyArguments& arguments) {
  const auto engine = OpenToRead(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const Result<VocabularyAnswer> vocabulary = (*engine)->Ask().Vocabulary();
  if (!vocabulary.ok()) return Fail(vocabulary.status());
  PrintJson(ToJson(*vocabulary));
  return kDone;
}

CLI::App* RegisterOne(CLI::App* vocabulary, const char* name, const char* help,
                      int (*run)(const VocabularyArguments&), int* exit_code,
                      std::shared_ptr<VocabularyArguments> arguments) {
  CLI::App* command = vocabulary->add_subcommand(name, help);
  command->add_option("DB", arguments->db, "Database")->required();
  command->callback([=] { *exit_code = run(*arguments); });
  return command;
}

}  // namespace

void RegisterVocabulary(CLI::App* app, int* exit_code) {
  CLI::App* vocabulary =
      app->add_subcommand("vocabulary", "The tree of visual words that photos are found by");
  vocabulary->require_subcommand(1);
  auto arguments = std::make_shared<VocabularyArguments>();  // one subcommand runs
  CLI::App* train =
      RegisterOne(vocabulary, "train", "Train the next generation from the stored photos now",
                  Train, exit_code, arguments);
  VocabularyRequest& request = arguments->request;
  train->add_option("--branch", request.branch, "Children of a node at most, 2 to 64 (10)");
  train->add_option("--levels", request.levels, "Levels below the root at most, 1 to 7 (7)");
  train->add_option("--sample", request.sample,
                    "Descriptors to train on at most, of all photos, from 1000 on (2000000)");
  RegisterOne(vocabulary, "import", "Use a given tree, and do not re-train", Import, exit_code,
              arguments)
      ->add_option("FILE", arguments->file, "Vocabulary file")
      ->required();
  RegisterOne(vocabulary, "export", "Write the active tree", Export, exit_code, arguments)
      ->add_option("FILE", arguments->file, "Vocabulary file")
      ->required();
  RegisterOne(vocabulary, "info", "Size and origin of the active tree, JSON", Info, exit_code,
              arguments)
      ->add_flag("--json", arguments->json, "JSON, which it is in any case");
}

}  // namespace veduta
