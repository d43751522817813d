// SPDX-License-Identifier: Apache-2.0
// veduta render DB OUT.png [--from IMAGE [--compare]] [--reconstruction ID] [--side
// front|left|right] [--size PX] [--shading color|clay|normal] [--points] [--json]
#include "cli/command.h"
#include "cli/wire/dense_json.h"

namespace veduta {
namespace {

struct RenderArguments {
  std::string db;
  uint32_t reconstruction = 0;
  RenderRequest request;
  bool json = false;
};

int Render(const RenderArguments& arguments) {
  const auto engine = OpenToRead(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  RenderRequest request = arguments.request;
  request.reconstruction = ReconstructionId(arguments.reconstruction);
  const Result<RenderReport> report = (*engine)->Ask().Render(request);
  if (!report.ok()) return Fail(report.status());
  if (!request.compare) return kDone;  // the picture is the result
  if (arguments.json) {
    PrintJson(ToJson(*report));
  } else {
    PrintLine("%s: covered %.1f %%, median absolute error %.1f of 255, exposure balanced %.1f",
              Printable(request.from).c_str(), 100 * report->covered_share, report->error_median,
              report->error_median_balanced);
  }
  return kDone;
}

}  // namespace

void RegisterRender(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<RenderArguments>();
  RenderRequest& request = arguments->request;
  CLI::App* command =
      app->add_subcommand("render", "A picture of a surface, or of points where there is none yet");
  command->add_option("DB", arguments->db, "Database")->required();
  command->add_option("OUT", request.path, "PNG file to write")->required();
  command->add_option("--from", request.from, "Seen by the camera of the photo that this means");
  command
      ->add_flag("--compare", request.compare,
                 "With --from: photo, picture and difference side by side, and the error")
      ->needs("--from");
  command
      ->add_option("--reconstruction", arguments->reconstruction,
                   "Without --from: which (default: the largest)")
      ->check(AboveZero())
      ->excludes("--from");
  command->add_option("--side", request.side, "Without --from: front, left or right")
      ->check(CLI::IsMember({"front", "left", "right"}))
      ->excludes("--from");
  command
      ->add_option("--size", request.side_px,
                   "Longer side of the picture, px (default: the photo's, or 1600)")
      ->check(CLI::Range(16, 16384));
  command->add_option("--shading", request.shading, "color, clay or normal")
      ->check(CLI::IsMember({"color", "clay", "normal"}));
  command->add_flag("--points", request.points, "The sparse points, also where there is a surface");
  command->add_flag("--json", arguments->json, "With --compare: the error as a JSON object");
  command->callback([=] { *exit_code = Render(*arguments); });
}

}  // namespace veduta
