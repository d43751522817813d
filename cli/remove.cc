// SPDX-License-Identifier: Apache-2.0
// veduta remove DB [PHOTO...] [--contributor WHO] [--contribution NUMBER] [--by WHO] [--why TEXT]
// [--threads N] [--json]
#include "cli/beside_daemon.h"
#include "cli/command.h"
#include "cli/follow_ups.h"
#include "cli/stop_on_signal.h"
#include "cli/wire/removal_json.h"

namespace veduta {
namespace {

struct RemoveArguments {
  std::string db;
  RemoveRequest request;
  uint32_t threads = 0;
  bool json = false;
};

void PrintRemoved(const RemovedPhoto& photo, const Questions& ask) {
  PrintLine("removed    %s (#%u)", Printable(photo.name).c_str(), photo.image.value);
  for (const ImageId id : photo.unplaced) {
    const Result<ImageAnswer> image = ask.Image("#" + std::to_string(id.value));
    if (image.ok()) PrintLine("  unplaced %s", Printable(image->name).c_str());
  }
}

void PrintRest(const RemoveAnswer& answer) {
  if (answer.uploads > 0)
    PrintLine("removed    %lu photos that waited for their turn", answer.uploads);
  if (answer.purged.ok()) PrintLine("no file of the database has bytes of removed photos any more");
  for (const RemovedPhoto& photo : answer.removed) {
    if (!photo.was_dense) continue;
    PrintLine("parts of the surface went with them: `veduta densify` makes them anew");
    break;
  }
  for (const std::string& copy : answer.copies)
    PrintLine("out of reach: the copy in %s", Printable(copy).c_str());
  if (!answer.removed.empty() || answer.uploads > 0)
    PrintLine("out of reach: copies of the folder that others have made");
}

// What stood on the photos is tried again. A step that fails is told and keeps nothing removed.
Status SettleAfter(Engine* engine, const std::string& db, bool json, std::stop_token stop) {
  return engine->Settle(std::move(stop), [&](const FollowUp& step) {
    const Questions ask = engine->Ask();
    if (!step.status.ok()) {
      std::fprintf(stderr, "%s\n", FollowUpFailure(step, ask, db).c_str());
    } else if (!json) {
      if (step.merged_into.valid()) PrintLine("%-10s %s", "  then", JoinedText(step).c_str());
      PrintHealed(step.unplaced, step.split_off, ask);
      PrintPlacedLater(step.placed, ask);
    }
  });
}

int Remove(const RemoveArguments& arguments) {
  const StopOnSignal stop;
  if (auto daemon = DaemonClient::Connect(arguments.db))
    return RemoveBeside(&*daemon, arguments.request, arguments.json);
  EngineOptions options;
  options.thread_count = arguments.threads;
  const auto engine = OpenToWrite(arguments.db, options);
  if (!engine.ok()) return Fail(engine.status());
  const auto told = [&](const RemovedPhoto& photo) {
    if (!arguments.json) PrintRemoved(photo, (*engine)->Ask());
  };
  const auto answer = (*engine)->Remove(arguments.request, stop.token(), told);
  if (!answer.ok()) return Fail(answer.status());
  if (arguments.json) {
    PrintJson(ToJson(*answer));
  } else {
    PrintRest(*answer);
  }
  if (!answer->purged.ok()) return Fail(answer->purged);
  const Status settled = SettleAfter(engine->get(), arguments.db, arguments.json, stop.token());
  return settled.ok() ? kDone : Fail(settled);
}

}  // namespace

void RegisterRemove(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<RemoveArguments>();
  CLI::App* command = app->add_subcommand(
      "remove", "Take photos out, with all that was derived from them and with their bytes");
  command->add_option("DB", arguments->db, "Database")->required();
  CLI::Option* photos = command->add_option(
      "PHOTO", arguments->request.photos,
      std::string(kPhotoHelp) + "; none: finish what a killed removal has left");
  CLI::Option* contributor = command
                                 ->add_option("--contributor", arguments->request.contributor,
                                              "All photos of this contributor instead")
                                 ->excludes(photos);
  command
      ->add_option("--contribution", arguments->request.contribution,
                   "All photos of the contribution of this number instead")
      ->check(AboveZero())
      ->excludes(photos)
      ->excludes(contributor);
  command->add_option("--by", arguments->request.actor, "Who has them removed, for the journal")
      ->capture_default_str();
  command->add_option("--why", arguments->request.why, "Why, for the journal");
  command->add_option("--threads", arguments->threads, "Threads (default: one per core)")
      ->check(CLI::Range(1, 1024));
  command->add_flag("--json", arguments->json, "JSON");
  command->callback([=] { *exit_code = Remove(*arguments); });
}

}  // namespace veduta
