// SPDX-License-Identifier: Apache-2.0
// veduta-bench-localization: localises photos in a database that was made without them, and
// compares with the truth, and with the poses that they have once they are added as well.
// Exit codes: 0 done; 1 it could not be done; 2 bad usage.

#include <CLI/CLI.hpp>
#include <cstdio>

#include "tools/bench/localization/localization_score.h"
#include "tools/bench/orders/scratch_folder.h"

namespace veduta::localization {
namespace {

struct Arguments {
  std::string photos, truth, size, params;
  uint32_t hold_out = 0, threads = 2;
  bool unknown = false;
};

// Photos to add, then photos to ask about.
using Split = std::pair<std::vector<orders::OrderedPhoto>, std::vector<orders::OrderedPhoto>>;

std::vector<Split> SplitsOf(const std::vector<orders::OrderedPhoto>& photos, uint32_t hold_out) {
  std::vector<Split> splits;
  if (hold_out > 0) {
    const auto middle = photos.end() - hold_out;
    splits.push_back({{photos.begin(), middle}, {middle, photos.end()}});
    return splits;
  }
  for (size_t i = 0; i < photos.size(); ++i) {
    std::vector<orders::OrderedPhoto> others = photos;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    splits.push_back({std::move(others), {photos[i]}});
  }
  return splits;
}

Status Measure(const Arguments& arguments) {
  VEDUTA_ASSIGN_OR_RETURN(const CameraModel camera, ParseCamera(arguments.size, arguments.params));
  VEDUTA_ASSIGN_OR_RETURN(const orders::Truth truth, orders::ReadTruth(arguments.truth));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<orders::OrderedPhoto> photos,
                          orders::ListFolder(arguments.photos));
  if (arguments.hold_out >= photos.size())
    return Status::InvalidArgument("--hold-out leaves no photo to add");
  std::vector<PhotoScore> all;
  double seconds = 0;
  for (const auto& [added, asked] : SplitsOf(photos, arguments.hold_out)) {
    VEDUTA_ASSIGN_OR_RETURN(const orders::ScratchFolder folder, orders::ScratchFolder::Make());
    VEDUTA_ASSIGN_OR_RETURN(
        const LocalizationRun run,
        RunLocalization(added, asked, camera, arguments.unknown, arguments.threads, folder.path()));
    seconds += run.seconds;
    for (PhotoScore& score : ScoreLocalization(run, truth)) {
      std::fputs(PhotoText(score).c_str(), stdout);
      all.push_back(std::move(score));
    }
    std::fflush(stdout);
  }
  std::fputs(Summary(all).c_str(), stdout);
  std::printf("wall clock: %.2f s with %u threads\n", seconds, arguments.threads);
  return {};
}

int Run(int argc, char** argv) {
  CLI::App app("How near photos are localised to where they were taken");
  Arguments arguments;
  app.add_option("PHOTOS", arguments.photos, "a folder of photos that one camera took")->required();
  app.add_option("TRUTH", arguments.truth, "a folder of files NAME.camera in Strecha's layout")
      ->required();
  app.add_option("--size", arguments.size, "WIDTHxHEIGHT of the camera in px")->required();
  app.add_option("--params", arguments.params, "fx,fy,cx,cy[,k1,k2[,u0,v0]]")->required();
  app.add_option("--hold-out", arguments.hold_out,
                 "localise so many photos, the last by name, in a database of the others; without "
                 "it each photo is localised in a database of all others");
  app.add_flag("--unknown", arguments.unknown,
               "localise as photos of an unknown camera, and score its focal length");
  app.add_option("--threads", arguments.threads, "threads (2)")->check(CLI::Range(1, 1024));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  const Status status = Measure(arguments);
  if (status.ok()) return 0;
  std::fprintf(stderr, "veduta-bench-localization: %s\n", status.message().c_str());
  return status.code() == StatusCode::kInvalidArgument ? 2 : 1;
}

}  // namespace
}  // namespace veduta::localization

int main(int argc, char** argv) {
  return veduta::localization::Run(argc, argv);
}
