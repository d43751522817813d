// SPDX-License-Identifier: Apache-2.0
// veduta render DB OUT.png [--from IMAGE] [--compare] [--reconstruction ID] [--side
// front|left|right] [--points]
#include "cli/command.h"
#include "fusion/dense_door.h"

namespace veduta {
namespace {

struct RenderArguments {
  std::string db, out, from, side = "front", shading = "color";
  uint32_t reconstruction = 0, size_px = 0;
  bool points = false, compare = false;
};

Result<ImageId> FindImageByName(const Snapshot& snapshot, const std::string& name) {
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<ImageId> image, snapshot.FindImageByName(name));
  if (image) return *image;
  return Status::NotFound("there is no image '" + name + "' in the database");
}

int Render(const RenderArguments& arguments) {
  const auto engine = OpenToRead(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  RenderRequest request;
  request.path = arguments.out;
  request.reconstruction = ReconstructionId(arguments.reconstruction);
  request.from = arguments.from;
  request.compare = arguments.compare;
  request.side = arguments.side;
  request.shading = arguments.shading;
  request.points = arguments.points;
  request.side_px = arguments.size_px;
  const auto report = RenderToFile((*engine)->database()->GetSnapshot(), *(*engine)->pool(),
                                   request, FindImageByName);
  if (!report.ok()) return Fail(report.status());
  if (arguments.compare) {
    std::printf("%s: covered %.1f %%, median absolute error %.1f of 255, exposure balanced %.1f\n",
                arguments.from.c_str(), 100 * report->covered_share, report->error_median,
                report->error_median_balanced);
  }
  return kDone;
}

}  // namespace

void RegisterRender(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<RenderArguments>();
  CLI::App* command =
      app->add_subcommand("render", "A picture of a surface, or of points where there is none yet");
  command->add_option("DB", arguments->db, "Database")->required();
  command->add_option("OUT", arguments->out, "PNG file to write")->required();
  command->add_option("--from", arguments->from,
                      "Seen by this photo's camera, by the photo's name");
  command
      ->add_flag("--compare", arguments->compare,
                 "With --from: photo, picture and difference side by side, and the error")
      ->needs("--from");
  command
      ->add_option("--reconstruction", arguments->reconstruction,
                   "Without --from: which (default: the largest)")
      ->check(CLI::PositiveNumber)
      ->excludes("--from");
  command->add_option("--side", arguments->side, "Without --from: front, left or right")
      ->check(CLI::IsMember({"front", "left", "right"}))
      ->excludes("--from");
  command
      ->add_option("--size", arguments->size_px,
                   "Longer side of the picture, px (default: the photo's, or 1600)")
      ->check(CLI::Range(16, 16384));
  command->add_option("--shading", arguments->shading, "color, clay or normal")
      ->check(CLI::IsMember({"color", "clay", "normal"}));
  command->add_flag("--points", arguments->points,
                    "The sparse points, also where there is a surface");
  command->callback([=] { *exit_code = Render(*arguments); });
}

}  // namespace veduta
