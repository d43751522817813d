// SPDX-License-Identifier: Apache-2.0
// veduta add DB [--camera NAME] PHOTO|FOLDER... [--list FILE] [--threads N] [--contributor WHO]
// [--json] [--no-sync] [--decoders sandboxed|in-process] [--doubles keep|refuse|better]
// [--blur PROGRAM]
#include <algorithm>
#include <map>
#include <set>

#include "cli/beside_daemon.h"
#include "cli/blur.h"
#include "cli/command.h"
#include "cli/decoders.h"
#include "cli/doubles.h"
#include "cli/follow_ups.h"
#include "cli/progress.h"
#include "cli/stop_on_signal.h"
#include "cli/wire/added_json.h"

namespace veduta {
namespace {

struct AddArguments {
  std::string db, camera, list;
  // Content of the database like a photo's name, so it does not come from the environment: the same
  // photos give the same digest, whoever adds them.
  std::string contributor = "anonymous";
  std::vector<std::string> paths;
  uint32_t threads = 0;
  std::string decoders = kDecodersInProcess;
  Doubles doubles = Doubles::kKeep;
  std::string blur_command;
  bool json = false, no_sync = false;
};

// Every photo with its camera.
Result<std::vector<PhotoSubmission>> Submissions(const AddArguments& arguments) {
  VEDUTA_ASSIGN_OR_RETURN(std::vector<ListedPhoto> listed,
                          ListPhotosOf(arguments.list, arguments.paths));
  std::vector<PhotoSubmission> submissions;
  for (ListedPhoto& photo : listed) {
    submissions.push_back({{std::move(photo.name), std::move(photo.path), {}},
                           photo.camera.empty() ? arguments.camera : std::move(photo.camera),
                           arguments.contributor});
  }
  return submissions;
}

// Says what becomes of the photos, one after the other, and keeps count.
class AddReport final {
 public:
  AddReport(const Engine& engine, const AddArguments& arguments, size_t photo_count)
      : engine_(engine), arguments_(arguments), progress_(photo_count) {}

  // A step that followed from a photo, told before the photo itself. What a step placed stands in
  // the photo's outcome; a step that failed, or that merged two reconstructions, is said here.
  void Followed(const FollowUp& step) {
    if (step.merged_into.valid()) progress_.Say("veduta: " + JoinedText(step));
    if (step.status.ok()) return;
    progress_.Say(FollowUpFailure(step, engine_.Ask(), arguments_.db));
    exit_code_ = std::max(exit_code_, ExitCodeOf(step.status));
  }

  void Added(const AddOutcome& outcome) {
    for (const DamagedImage& damaged : outcome.damaged) {
      if (!damaged_.insert(damaged.image).second) continue;  // said already
      progress_.Say(DamagedImageText(damaged, engine_.Ask(), arguments_.db));
      exit_code_ = std::max<int>(exit_code_, kDatabaseUnusable);
    }
    const std::string word = OutcomeWord(outcome);
    ++counts_[word];
    if (!outcome.failure.ok()) {
      // What is busy is not the database: the program of --blur has not told what is private.
      const bool is_untold = outcome.failure.code() == StatusCode::kBusy;
      exit_code_ = std::max<int>(exit_code_, is_untold ? kNotDone : ExitCodeOf(outcome.failure));
    } else if (!outcome.duplicate && outcome.verdict == Verdict::kRejected) {
      exit_code_ = std::max<int>(exit_code_, kNotDone);
    }
    placed_later_ += outcome.propagated.size();
    lost_poses_ += outcome.unplaced.size();
    split_off_ += outcome.split_off.size();
    if (arguments_.json) {
      PrintJson(ToJson(outcome));
    } else {
      PrintLine("%-10s %s: %s", word.c_str(), Printable(outcome.name).c_str(),
                Printable(OutcomeReason(outcome)).c_str());
      if (!outcome.camera.empty()) PrintLine("  with camera %s", Printable(outcome.camera).c_str());
      PrintHealed(outcome.unplaced, outcome.split_off, engine_.Ask());
      if (!outcome.propagated.empty()) PrintPlacedLater(outcome.propagated, engine_.Ask());
    }
    progress_.Advance(word);
  }

  // "9 placed, 1 postponed; 2 that had waited got a pose too; 3 lost their poses"; empty where no
  // photo was added.
  std::string Summary() const {
    std::string summary = TextOfCounts(counts_);
    if (placed_later_ > 0) {
      summary += "; " + std::to_string(placed_later_) + " that had waited got a pose too";
    }
    if (lost_poses_ > 0) summary += "; " + std::to_string(lost_poses_) + " lost their poses";
    if (split_off_ > 0)
      summary += "; " + std::to_string(split_off_) + " reconstructions were split off";
    return summary;
  }

  // kDone, or the worst that was told.
  int exit_code() const { return exit_code_; }

 private:
  const Engine& engine_;
  const AddArguments& arguments_;
  Progress progress_;
  std::map<std::string, size_t> counts_;  // by verdict
  std::set<ImageId> damaged_;             // that were named
  size_t placed_later_ = 0, lost_poses_ = 0, split_off_ = 0;
  int exit_code_ = kDone;
};

// In a city without a photo, the first photos say together what their cameras are.
Status CalibrateFirst(Engine* engine, std::span<PhotoSubmission> photos, std::stop_token stop) {
  const bool is_named =
      std::ranges::none_of(photos, [](const PhotoSubmission& one) { return one.camera.empty(); });
  if (is_named) return Status::Ok();
  VEDUTA_ASSIGN_OR_RETURN(const StatusAnswer city, engine->Ask().Status());
  if (city.placed > 0) return Status::Ok();
  std::fprintf(stderr, "veduta: nothing is placed yet: the photos calibrate their cameras first\n");
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<FirstCamera> cameras,
                          engine->CalibrateFirst(photos, std::move(stop)));
  for (const FirstCamera& camera : cameras)
    std::fprintf(stderr, "veduta: %s\n", Printable(FirstCameraText(ToJson(camera))).c_str());
  return Status::Ok();
}

int Add(const AddArguments& arguments) {
  const StopOnSignal stop;
  if (auto daemon = DaemonClient::Connect(arguments.db)) {
    if (!arguments.blur_command.empty())
      return Fail(Status::InvalidArgument(
          "a daemon serves " + arguments.db +
          ", and what is private is filled as it was started: leave --blur out, or start it with "
          "--blur"));
    const auto photos = Submissions(arguments);
    if (!photos.ok()) return Fail(photos.status());
    return AddBeside(&*daemon, *photos, arguments.json, stop.token());
  }
  EngineOptions options;
  options.thread_count = arguments.threads;
  options.sync = !arguments.no_sync;
  options.decoder_program = DecoderProgram(arguments.decoders);
  options.doubles = arguments.doubles;
  options.blur_command = arguments.blur_command;
  const auto engine = OpenToWrite(arguments.db, options);
  if (!engine.ok()) return Fail(engine.status());
  auto submissions = Submissions(arguments);
  if (!submissions.ok()) return Fail(submissions.status());
  const Status calibrated = CalibrateFirst(engine->get(), *submissions, stop.token());
  if (!calibrated.ok()) return Fail(calibrated);

  std::string summary;
  int exit_code = kDone;
  Status added;
  {
    AddReport report(**engine, arguments, submissions->size());
    added = (*engine)->AddPhotos(
        *submissions, [&](const AddOutcome& outcome) { report.Added(outcome); }, stop.token(),
        [&](const FollowUp& step) { report.Followed(step); });
    summary = report.Summary();
    exit_code = report.exit_code();
  }  // which erases the bar
  if (!summary.empty()) std::fprintf(stderr, "%s\n", summary.c_str());
  return added.ok() ? exit_code : Fail(added);
}

}  // namespace

void RegisterAdd(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<AddArguments>();
  CLI::App* command =
      app->add_subcommand("add", "Add photos, each placed against all that came before");
  command->add_option("DB", arguments->db, "Database")->required();
  command->add_option("PHOTO", arguments->paths,
                      "Photos, or folders of photos; with --list the folder of its paths");
  command
      ->add_option("--camera", arguments->camera,
                   "The camera that took them (default: unknown; found by what the photos say of "
                   "themselves, or estimated from the photos that are there)")
      ->check(CheckCameraName);
  command->add_option("--list", arguments->list,
                      "File with one path per line, in the order of submission; after a tab a line "
                      "may name its camera");
  command->add_option("--threads", arguments->threads, "Threads (default: one per core)")
      ->check(CLI::Range(1, 1024));
  command->add_option("--contributor", arguments->contributor,
                      "Who sends them (default: anonymous)");
  command->add_flag("--json", arguments->json, "One JSON object per photo");
  AddDecodersOption(command, &arguments->decoders);
  AddDoublesOption(command, &arguments->doubles);
  AddBlurOption(command, &arguments->blur_command);
  command->add_flag("--no-sync", arguments->no_sync,
                    "Do not wait for the disk at each photo: a power cut may lose the last ones (a "
                    "crash does not)");
  command->callback([=] {
    CheckPhotoArguments(arguments->list, arguments->paths);
    *exit_code = Add(*arguments);
  });
}

}  // namespace veduta
