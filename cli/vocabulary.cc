// SPDX-License-Identifier: Apache-2.0
// veduta vocabulary train|info DB; veduta vocabulary import|export DB FILE
#include <cerrno>
#include <cstring>
#include <fstream>

#include "cli/command.h"

namespace veduta {
namespace {

struct VocabularyArguments {
  std::string db, file;
};

int Train(const VocabularyArguments& arguments) {
  const auto engine = OpenToWrite(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const Status trained = (*engine)->TrainVocabulary();
  return trained.ok() ? kDone : Fail(trained);
}

int Import(const VocabularyArguments& arguments) {
  std::ifstream file(arguments.file, std::ios::binary);
  if (!file)
    return Fail(Status::NotFound("cannot read " + arguments.file + ": " + std::strerror(errno)));
  const std::vector<char> bytes((std::istreambuf_iterator<char>(file)),
                                std::istreambuf_iterator<char>());
  const auto tree =
      VocabularyTree::Parse({reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()});
  if (!tree.ok()) {
    Fail(Status::InvalidArgument(arguments.file +
                                 " is not a vocabulary: " + tree.status().message()));
    return kNotDone;
  }
  const auto engine = OpenToWrite(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const Status imported = (*engine)->ImportVocabulary(*tree);
  return imported.ok() ? kDone : Fail(imported);
}

// Null with the exit code set when there is none.
std::shared_ptr<const VocabularyTree> Active(const Engine& engine, int* exit_code) {
  auto tree = engine.retrieval()->ActiveTree(engine.Ask().snapshot());
  if (!tree.ok()) {
    *exit_code = Fail(tree.status());
    return nullptr;
  }
  if (*tree == nullptr) {
    *exit_code =
        Fail(Status::NotFound("the database has no vocabulary yet; it trains one when it is large "
                              "enough, or `veduta vocabulary train`"));
  }
  return *tree;
}

int Export(const VocabularyArguments& arguments) {
  const auto engine = OpenToRead(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  int exit_code = kDone;
  const auto tree = Active(**engine, &exit_code);
  if (tree == nullptr) return exit_code;
  const std::vector<uint8_t> bytes = tree->Serialize();
  std::ofstream file(arguments.file, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  file.close();
  return file ? kDone
              : Fail(Status::IoError("cannot write " + arguments.file + ": " +
                                     std::strerror(errno)));
}

int Info(const VocabularyArguments& arguments) {
  const auto engine = OpenToRead(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  int exit_code = kDone;
  const auto tree = Active(**engine, &exit_code);
  if (tree == nullptr) return exit_code;
  const auto state = (*engine)->Ask().snapshot().GetState();
  if (!state.ok()) return Fail(state.status());
  const VocabularyInfo info = tree->info();
  const nlohmann::ordered_json out = {{"generation", state->vocabulary_generation},
                                      {"branch", info.branch},
                                      {"depth", info.depth},
                                      {"words", info.leaf_count},
                                      {"training_descriptors", info.training_size},
                                      {"images_at_training", state->images_at_vocabulary},
                                      {"imported", state->vocabulary_imported}};
  std::printf("%s\n", out.dump().c_str());
  return kDone;
}

void RegisterOne(CLI::App* vocabulary, const char* name, const char* help, bool wants_file,
                 int (*run)(const VocabularyArguments&), int* exit_code) {
  auto arguments = std::make_shared<VocabularyArguments>();
  CLI::App* command = vocabulary->add_subcommand(name, help);
  command->add_option("DB", arguments->db, "Database")->required();
  if (wants_file) command->add_option("FILE", arguments->file, "Vocabulary file")->required();
  command->callback([=] { *exit_code = run(*arguments); });
}

}  // namespace

void RegisterVocabulary(CLI::App* app, int* exit_code) {
  CLI::App* vocabulary =
      app->add_subcommand("vocabulary", "The tree of visual words that photos are found by");
  vocabulary->require_subcommand(1);
  RegisterOne(vocabulary, "train", "Train the next generation from the stored photos now", false,
              Train, exit_code);
  RegisterOne(vocabulary, "import", "Use a given tree, and do not re-train", true, Import,
              exit_code);
  RegisterOne(vocabulary, "export", "Write the active tree", true, Export, exit_code);
  RegisterOne(vocabulary, "info", "Size and origin of the active tree, JSON", false, Info,
              exit_code);
}

}  // namespace veduta
