// SPDX-License-Identifier: Apache-2.0
// veduta import DB MODEL --images FOLDER [--contributor WHO] [--threads N] [--json]
// [--decoders sandboxed|in-process]
#include <algorithm>

#include "cli/command.h"
#include "cli/decoders.h"
#include "cli/follow_ups.h"
#include "cli/owner_beside.h"
#include "cli/progress.h"
#include "cli/stop_on_signal.h"
#include "cli/wire/added_json.h"
#include "cli/wire/import_json.h"

namespace veduta {
namespace {

struct ImportArguments {
  std::string db;
  ImportRequest request;
  uint32_t threads = 0;
  std::string decoders = kDecodersInProcess;
  bool json = false;
};

void PrintPhoto(const ImportedPhoto& photo) {
  const std::string name = Printable(photo.name), why = Printable(photo.why_not);
  if (photo.reconstruction.valid()) {
    PrintLine("%-10s %s: in reconstruction %u, by %s", photo.was_given_pose ? "imported" : "placed",
              name.c_str(), photo.reconstruction.value,
              photo.was_given_pose ? "the model" : "what it sees");
  } else {
    PrintLine("%-10s %s: %s", photo.image.valid() ? "postponed" : "left out", name.c_str(),
              why.c_str());
  }
}

// How many of the model's photos have a pose now.
size_t PrintAnswer(const ImportAnswer& answer) {
  size_t given = 0, placed = 0;
  for (const ImportedPhoto& photo : answer.photos) {
    PrintPhoto(photo);
    given += photo.was_given_pose;
    placed += photo.reconstruction.valid();
  }
  if (answer.reconstruction.valid()) {
    PrintLine("reconstruction %u: %zu of %zu photos by the poses of the model, %llu points",
              answer.reconstruction.value, given, answer.photos.size(),
              static_cast<unsigned long long>(answer.points));
  } else {
    PrintLine("no reconstruction was made of the model");
  }
  return placed;
}

int PrintAll(const Result<ImportAnswer>& answer, bool json, int exit_code) {
  if (!answer.ok()) return Fail(answer.status());
  for (const std::string& message : answer->messages)
    std::fprintf(stderr, "veduta: %s\n", Printable(message).c_str());
  size_t placed = 0;
  if (json) {
    PrintJson(ToJson(*answer));
    placed = static_cast<size_t>(std::ranges::count_if(
        answer->photos, [](const ImportedPhoto& p) { return p.reconstruction.valid(); }));
  } else {
    placed = PrintAnswer(*answer);
  }
  return placed == answer->photos.size() ? exit_code : std::max<int>(exit_code, kNotDone);
}

std::string FailureOf(const AddOutcome& outcome) {
  return "veduta: " + Printable(outcome.name) + ": " + Printable(outcome.failure.message());
}

int ImportByDaemon(DaemonClient* daemon, const ImportArguments& arguments) {
  WarnOfThreads(arguments.threads);
  std::vector<FollowUp> failed;
  const Result<ImportAnswer> answer = ImportModelBeside(
      daemon, arguments.request,
      [](const AddOutcome& photo) { std::fprintf(stderr, "%s\n", FailureOf(photo).c_str()); },
      [&](const FollowUp& step) { failed.push_back(step); });
  if (failed.empty()) return PrintAll(answer, arguments.json, kDone);
  // The names of photos are asked of the database, as it is now.
  const auto engine = OpenToRead(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  int exit_code = kDone;
  for (const FollowUp& step : failed) {
    std::fprintf(stderr, "%s\n", FollowUpFailure(step, (*engine)->Ask(), arguments.db).c_str());
    exit_code = std::max(exit_code, ExitCodeOf(step.status));
  }
  return PrintAll(answer, arguments.json, exit_code);
}

int Import(const ImportArguments& arguments) {
  if (auto daemon = DaemonClient::Connect(arguments.db)) return ImportByDaemon(&*daemon, arguments);
  const StopOnSignal stop;
  EngineOptions options;
  options.thread_count = arguments.threads;
  options.decoder_program = DecoderProgram(arguments.decoders);
  const auto engine = OpenToWrite(arguments.db, options);
  if (!engine.ok()) return Fail(engine.status());
  int exit_code = kDone;
  Result<ImportAnswer> answer = Status::Cancelled("");
  {
    Progress progress(0);
    answer = (*engine)->Import(
        arguments.request, stop.token(),
        [&](const AddOutcome& outcome) {
          if (!outcome.failure.ok()) progress.Say(FailureOf(outcome));
        },
        [&](const FollowUp& step) {
          if (step.status.ok()) return;
          progress.Say(FollowUpFailure(step, (*engine)->Ask(), arguments.db));
          exit_code = std::max(exit_code, ExitCodeOf(step.status));
        });
  }
  return PrintAll(answer, arguments.json, exit_code);
}

}  // namespace

void RegisterImport(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<ImportArguments>();
  ImportRequest& request = arguments->request;
  CLI::App* command = app->add_subcommand(
      "import", "Make a reconstruction of a model of COLMAP, which grows on as photos are added");
  command->add_option("DB", arguments->db, "Database")->required();
  command->add_option("MODEL", request.model, "Folder of cameras, images and points3D")->required();
  command
      ->add_option("--images", request.photos,
                   "Folder that the names of the model's photos are relative to")
      ->required();
  command->add_option("--contributor", request.contributor, "Who sends them")
      ->capture_default_str();
  command->add_option("--threads", arguments->threads, "Threads (default: one per core)")
      ->check(CLI::Range(1, 1024));
  command->add_flag("--json", arguments->json, "JSON");
  AddDecodersOption(command, &arguments->decoders);
  command->callback([=] { *exit_code = Import(*arguments); });
}

}  // namespace veduta
