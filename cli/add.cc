// SPDX-License-Identifier: Apache-2.0
// veduta add DB --camera NAME PHOTO|FOLDER... [--list FILE] [--threads N] [--json]
#include <cstdlib>
#include <map>

#include "cli/command.h"
#include "cli/photo_list.h"
#include "cli/progress.h"
#include "cli/stop_on_signal.h"
#include "engine/query/verdict_text.h"

namespace veduta {
namespace {

struct AddArguments {
  std::string db, camera, list, contributor;
  std::vector<std::string> paths;
  uint32_t threads = 0;
  bool json = false, no_sync = false;
};

std::string VerdictWord(const AddOutcome& outcome) {
  return outcome.duplicate ? "duplicate" : VerdictText(outcome.verdict);
}

std::string ReasonSentence(const AddOutcome& outcome) {
  if (outcome.duplicate) return outcome.detail;
  const std::string reason = ReasonText(outcome.reason);
  return outcome.detail.empty() ? reason : reason + ": " + outcome.detail;
}

void PrintJson(const AddOutcome& outcome) {
  const StepTimes& t = outcome.times;
  nlohmann::ordered_json propagated = nlohmann::ordered_json::array();
  for (const ImageId id : outcome.propagated) propagated.push_back(id.value);
  const nlohmann::ordered_json line = {{"image", outcome.name},
                                       {"id", ToJson(outcome.id)},
                                       {"verdict", VerdictWord(outcome)},
                                       {"reason", ReasonSentence(outcome)},
                                       {"reconstruction", ToJson(outcome.reconstruction)},
                                       {"neighbors", outcome.neighbor_count},
                                       {"inliers", outcome.inlier_count},
                                       {"pairs_tried", outcome.pairs_tried},
                                       {"propagated", propagated},
                                       {"ms",
                                        {{"decode", t.decode_ms},
                                         {"undistort", t.undistort_ms},
                                         {"features", t.features_ms},
                                         {"retrieve", t.retrieve_ms},
                                         {"match", t.match_ms},
                                         {"verify", t.verify_ms},
                                         {"map", t.map_ms},
                                         {"adjust", t.adjust_ms},
                                         {"commit", t.commit_ms},
                                         {"follow", t.follow_ms},
                                         {"total", t.total_ms}}}};
  // Names come from file systems, which do not promise UTF-8.
  std::printf("%s\n",
              line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace).c_str());
  std::fflush(stdout);
}

// The verdict, and on lines of their own the photos before it that got a pose with it.
void PrintText(const Queries& ask, const AddOutcome& outcome) {
  std::printf("%-10s %s: %s\n", VerdictWord(outcome).c_str(), outcome.name.c_str(),
              ReasonSentence(outcome).c_str());
  for (const ImageId id : outcome.propagated) {
    const Result<ImageRecord> image = ask.snapshot().GetImage(id);
    if (image.ok())
      std::printf("%-10s %s: %s\n", "  then", image->name.c_str(), image->detail.c_str());
  }
  std::fflush(stdout);
}

// Every photo with its camera; cameras that a list names are looked up once.
Result<std::vector<PhotoSubmission>> Submissions(const Engine& engine,
                                                 const AddArguments& arguments) {
  std::vector<ListedPhoto> listed;
  if (!arguments.list.empty()) {
    const std::string folder = arguments.paths.empty() ? "" : arguments.paths.front();
    VEDUTA_ASSIGN_OR_RETURN(listed, ReadPhotoList(arguments.list, folder));
  } else {
    VEDUTA_ASSIGN_OR_RETURN(listed, ListPhotos(arguments.paths));
  }
  std::map<std::string, CameraRecord> cameras;
  std::vector<PhotoSubmission> submissions;
  for (ListedPhoto& photo : listed) {
    const std::string& name = photo.camera.empty() ? arguments.camera : photo.camera;
    if (!cameras.contains(name)) {
      VEDUTA_ASSIGN_OR_RETURN(cameras[name], engine.FindCamera(name));
    }
    submissions.push_back(
        {{std::move(photo.name), std::move(photo.path), {}}, name, arguments.contributor});
  }
  return submissions;
}

int Add(const AddArguments& arguments) {
  const StopOnSignal stop;
  EngineOptions options;
  options.thread_count = arguments.threads;
  options.database.sync_wal = !arguments.no_sync;
  const auto engine = OpenToWrite(arguments.db, options);
  if (!engine.ok()) return Fail(engine.status());
  const auto submissions = Submissions(**engine, arguments);
  if (!submissions.ok()) return Fail(submissions.status());

  std::map<std::string, size_t> counts;
  size_t placed_later = 0;
  bool refused = false;
  Status added;
  {
    Progress progress(submissions->size());
    added = (*engine)->AddPhotos(
        *submissions,
        [&](const AddOutcome& outcome) {
          const std::string word = VerdictWord(outcome);
          ++counts[word];
          placed_later += outcome.propagated.size();
          refused |= !outcome.duplicate && outcome.verdict == Verdict::kRejected;
          if (arguments.json) {
            PrintJson(outcome);
          } else {
            PrintText((*engine)->Ask(), outcome);
          }
          progress.Advance(word);
        },
        stop.token());
  }
  std::string summary;
  for (const auto& [word, count] : counts) {
    summary += (summary.empty() ? "" : ", ") + std::to_string(count) + " " + word;
  }
  if (placed_later > 0)
    summary += "; " + std::to_string(placed_later) + " that had waited got a pose too";
  if (!summary.empty()) std::fprintf(stderr, "%s\n", summary.c_str());
  if (!added.ok()) return Fail(added);
  return refused ? kNotDone : kDone;
}

}  // namespace

void RegisterAdd(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<AddArguments>();
  if (const char* user = std::getenv("USER")) arguments->contributor = user;
  CLI::App* command =
      app->add_subcommand("add", "Add photos, each placed against all that came before");
  command->add_option("DB", arguments->db, "Database")->required();
  command->add_option("PHOTO", arguments->paths,
                      "Photos, or folders of photos; with --list the folder of its paths");
  command->add_option("--camera", arguments->camera, "The camera that took them")->required();
  command->add_option("--list", arguments->list,
                      "File with a path a line, in the order of submission; after a tab a line may "
                      "name its camera");
  command->add_option("--threads", arguments->threads, "Threads (default: one a core)")
      ->check(CLI::Range(1, 1024));
  command->add_option("--contributor", arguments->contributor,
                      "Who sends them (default: the user)");
  command->add_flag("--json", arguments->json, "One JSON object a photo");
  command->add_flag("--no-sync", arguments->no_sync,
                    "Do not wait for the disk at each photo: a power cut may lose the last ones (a "
                    "crash does not)");
  command->callback([=] {
    if (arguments->paths.empty() && arguments->list.empty()) {
      throw CLI::RequiredError("PHOTO or --list");
    }
    if (arguments->paths.size() > 1 && !arguments->list.empty()) {
      throw CLI::ValidationError(
          "--list", "takes one folder at most, the one that its paths are relative to");
    }
    *exit_code = Add(*arguments);
  });
}

}  // namespace veduta
