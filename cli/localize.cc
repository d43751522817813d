// SPDX-License-Identifier: Apache-2.0
// veduta localize DB [--camera NAME] PHOTO|FOLDER... [--list FILE] [--near PHOTO | --walk]
// [--near-place LAT,LON] [--threads N] [--json]
#include <algorithm>
#include <map>
#include <optional>
#include <set>

#include "cli/command.h"
#include "cli/earth_pose_text.h"
#include "cli/follow_ups.h"
#include "cli/progress.h"
#include "cli/stop_on_signal.h"
#include "cli/wire/added_json.h"
#include "cli/wire/place_text.h"

namespace veduta {
namespace {

struct LocalizeArguments {
  std::string db, camera, list, near;
  std::optional<GeoPosition> near_place;
  bool walk = false;
  std::vector<std::string> paths;
  uint32_t threads = 0;
  bool json = false;
};

// Every photo with its camera.
Result<std::vector<LocalizeRequest>> Requests(const LocalizeArguments& arguments) {
  VEDUTA_ASSIGN_OR_RETURN(std::vector<ListedPhoto> listed,
                          ListPhotosOf(arguments.list, arguments.paths));
  std::vector<LocalizeRequest> requests;
  for (ListedPhoto& photo : listed) {
    requests.push_back({{std::move(photo.name), std::move(photo.path), {}},
                        photo.camera.empty() ? arguments.camera : std::move(photo.camera),
                        arguments.near,
                        arguments.near_place});
  }
  return requests;
}

void PrintPlace(const LocalizedPhoto& photo) {
  const std::array<double, 3>& center = photo.cam_from_world->center;
  const std::string where =
      photo.uncertainty ? "" : "; too little is seen to tell how sure that is";
  PrintLine("  in reconstruction %u, centre %.6g %.6g %.6g, by %zu images%s",
            photo.reconstruction.value, center[0], center[1], center[2], photo.support.size(),
            where.c_str());
  if (photo.on_earth) PrintEarthPose(*photo.on_earth, "  ");
  if (const auto& camera = photo.camera) {
    PrintLine("  focal length %.6g px, k1 %.3g, k2 %.3g; standard deviations %.2g, %.2g, %.2g",
              camera->model.fx, camera->model.k1, camera->model.k2,
              camera->focal_stddev_share * camera->model.fx, camera->k1_stddev, camera->k2_stddev);
  }
  if (!photo.uncertainty) return;
  PrintLine("  standard deviation of the centre %.3g, of the rotation %.3g degrees",
            photo.uncertainty->center_stddev, photo.uncertainty->rotation_stddev_deg);
}

// Says where the photos were taken, one after the other, and keeps count.
class LocalizeReport final {
 public:
  LocalizeReport(const Questions& ask, const LocalizeArguments& arguments, size_t photo_count)
      : ask_(ask), arguments_(arguments), progress_(photo_count) {}

  void Done(const LocalizedPhoto& photo) {
    for (const DamagedImage& damaged : photo.damaged) {
      if (!damaged_.insert(damaged.image).second) continue;  // said already
      progress_.Say(DamagedImageText(damaged, ask_, arguments_.db));
      exit_code_ = std::max<int>(exit_code_, kDatabaseUnusable);
    }
    const std::string word = LocalizedWord(photo);
    ++counts_[word];
    if (!photo.cam_from_world)
      exit_code_ =
          std::max<int>(exit_code_, photo.failure.ok() ? int{kNotDone} : ExitCodeOf(photo.failure));
    if (arguments_.json) {
      PrintJson(ToJson(photo));
    } else {
      PrintLine("%-10s %s: %s", word.c_str(), Printable(photo.name).c_str(),
                Printable(LocalizedReason(photo)).c_str());
      if (photo.cam_from_world) PrintPlace(photo);
    }
    progress_.Advance(word);
  }

  // "9 localized, 1 refused"; empty where nothing was done.
  std::string Summary() const { return TextOfCounts(counts_); }

  // kDone, or the worst that was told.
  int exit_code() const { return exit_code_; }

 private:
  const Questions& ask_;
  const LocalizeArguments& arguments_;
  Progress progress_;
  std::map<std::string, size_t> counts_;  // by verdict
  std::set<ImageId> damaged_;             // that were named
  int exit_code_ = kDone;
};

// One photo after another, each sought first near the one before it that has a pose.
Status LocalizeWalk(const Questions& ask, std::vector<LocalizeRequest>* requests,
                    LocalizeReport* report, const std::stop_token& stop) {
  std::string near;
  for (LocalizeRequest& request : *requests) {
    if (!near.empty()) request.near = near;
    VEDUTA_RETURN_IF_ERROR(ask.Localize(
        {&request, 1},
        [&](const LocalizedPhoto& photo) {
          if (!photo.support.empty()) near = "#" + std::to_string(photo.support[0].image.value);
          report->Done(photo);
        },
        stop));
  }
  return Status::Ok();
}

int Localize(const LocalizeArguments& arguments) {
  const StopOnSignal stop;
  const auto engine = OpenToRead(arguments.db, arguments.threads);
  if (!engine.ok()) return Fail(engine.status());
  auto requests = Requests(arguments);
  if (!requests.ok()) return Fail(requests.status());
  const Questions ask = (*engine)->Ask();
  std::string summary;
  int exit_code = kDone;
  Status localized;
  {
    LocalizeReport report(ask, arguments, requests->size());
    if (arguments.walk) {
      localized = LocalizeWalk(ask, &*requests, &report, stop.token());
    } else {
      localized = ask.Localize(
          *requests, [&](const LocalizedPhoto& photo) { report.Done(photo); }, stop.token());
    }
    summary = report.Summary();
    exit_code = report.exit_code();
  }  // which erases the bar
  if (!summary.empty()) std::fprintf(stderr, "%s\n", summary.c_str());
  return localized.ok() ? exit_code : Fail(localized);
}

}  // namespace

void RegisterLocalize(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<LocalizeArguments>();
  CLI::App* command = app->add_subcommand(
      "localize", "Say where photos were taken, without adding them; changes nothing");
  command->add_option("DB", arguments->db, "Database")->required();
  command->add_option("PHOTO", arguments->paths,
                      "Photos, or folders of photos; with --list the folder of its paths");
  command
      ->add_option("--camera", arguments->camera,
                   "The camera that took them (default: unknown; its focal length and its "
                   "distortion are estimated)")
      ->check(CheckCameraName);
  command->add_option("--list", arguments->list,
                      "File with one path per line; after a tab a line may name its camera");
  CLI::Option* const near =
      command->add_option("--near", arguments->near,
                          "A stored photo near which they were taken: they are sought there first");
  command
      ->add_flag("--walk", arguments->walk,
                 "They were taken one after another: each is sought first near the one before it")
      ->excludes(near);
  command->add_option_function<std::string>(
      "--near-place",
      [=](const std::string& text) {
        arguments->near_place = ParsePlace(text);
        if (!arguments->near_place)
          throw CLI::ValidationError("--near-place", "'" + text + "' is no LATITUDE,LONGITUDE");
      },
      "LATITUDE,LONGITUDE about where they were taken, in degrees: they are sought there first");
  command->add_option("--threads", arguments->threads, "Threads (default: one per core)")
      ->check(CLI::Range(1, 1024));
  command->add_flag("--json", arguments->json, "One JSON object per photo");
  command->callback([=] {
    CheckPhotoArguments(arguments->list, arguments->paths);
    *exit_code = Localize(*arguments);
  });
}

}  // namespace veduta
