// SPDX-License-Identifier: Apache-2.0
// veduta neighbors DB IMAGE|PHOTO [--json] [--camera NAME] [--count N]
#include <filesystem>

#include "cli/command.h"
#include "cli/wire/answers_json.h"

namespace veduta {
namespace {

struct NeighborArguments {
  std::string db, image, camera;
  uint32_t count = 20;
  bool json = false;
};

int PrintNeighbors(const std::vector<NeighborAnswer>& neighbors, bool json) {
  if (json) {
    PrintJson(ToJson(neighbors));
    return kDone;
  }
  for (const NeighborAnswer& neighbor : neighbors) {
    PrintLine("%10u  %s (#%u)", neighbor.matches, Printable(neighbor.name).c_str(),
              neighbor.image.value);
  }
  return kDone;
}

int PrintCandidates(const std::vector<NeighborAnswer>& candidates, bool json) {
  if (json) {
    PrintJson(CandidatesJson(candidates));
    return kDone;
  }
  for (const NeighborAnswer& candidate : candidates) {
    PrintLine("%10.6f  %s (#%u)", candidate.score, Printable(candidate.name).c_str(),
              candidate.image.value);
  }
  return kDone;
}

int Neighbors(const NeighborArguments& arguments) {
  const auto engine = OpenToRead(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const Questions ask = (*engine)->Ask();
  const auto stored = ask.Neighbors(arguments.image);
  if (stored.ok()) return PrintNeighbors(*stored, arguments.json);
  if (stored.status().code() != StatusCode::kNotFound) return Fail(stored.status());
  std::error_code error;
  if (!std::filesystem::is_regular_file(arguments.image, error)) {
    return Fail(Status::NotFound("'" + arguments.image +
                                 "' is neither an image in the database nor a file"));
  }
  const auto ranked =
      ask.Rank({arguments.image, arguments.image, {}}, arguments.camera, arguments.count);
  return ranked.ok() ? PrintCandidates(*ranked, arguments.json) : Fail(ranked.status());
}

}  // namespace

void RegisterNeighbors(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<NeighborArguments>();
  CLI::App* command = app->add_subcommand(
      "neighbors", "Verified neighbours of a stored photo, or ranked candidates for a new one");
  command->add_option("DB", arguments->db, "Database")->required();
  command
      ->add_option("IMAGE", arguments->image,
                   "A stored image, as for `show`, or the path of a photo that is not stored")
      ->required();
  command->add_option("--camera", arguments->camera, "Camera of a new photo, to undistort it by");
  command->add_option("--count", arguments->count, "Candidates at most (default 20)")
      ->check(CLI::Range(1, 100'000));
  command->add_flag("--json", arguments->json, "JSON");
  command->callback([=] { *exit_code = Neighbors(*arguments); });
}

}  // namespace veduta
