// SPDX-License-Identifier: Apache-2.0
// veduta neighbors DB IMAGE|PHOTO [--json] [--camera NAME] [--count N]
#include <filesystem>

#include "cli/command.h"

namespace veduta {
namespace {

struct NeighborArguments {
  std::string db, image, camera;
  uint32_t count = 20;
  bool json = false;
};

int Print(const nlohmann::ordered_json& list, const NeighborArguments& arguments,
          const char* measure) {
  if (arguments.json) {
    std::printf(
        "%s\n",
        list.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace).c_str());
    return kDone;
  }
  for (const auto& entry : list)
    std::printf("%10s  %s\n", entry[measure].dump().c_str(),
                entry["image"].get<std::string>().c_str());
  return kDone;
}

int Stored(const Queries& ask, const ImageRecord& image, const NeighborArguments& arguments) {
  const auto neighbors = ask.Neighbors(image.id);
  if (!neighbors.ok()) return Fail(neighbors.status());
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const PairNeighbor& neighbor : *neighbors) {
    const Result<ImageRecord> other = ask.snapshot().GetImage(neighbor.image);
    if (!other.ok()) return Fail(other.status());
    list.push_back({{"image", other->name}, {"matches", neighbor.match_count}});
  }
  return Print(list, arguments, "matches");
}

int Unknown(const Engine& engine, const NeighborArguments& arguments) {
  std::optional<CameraModel> model;
  if (!arguments.camera.empty()) {
    const Result<CameraRecord> camera = engine.FindCamera(arguments.camera);
    if (!camera.ok()) return Fail(camera.status());
    model = camera->model;
  }
  const auto ranked =
      engine.RankPhoto({arguments.image, arguments.image, {}}, model, arguments.count);
  if (!ranked.ok()) return Fail(ranked.status());
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  const Queries ask = engine.Ask();
  for (const RankedImage& candidate : *ranked) {
    const Result<ImageRecord> other = ask.snapshot().GetImage(candidate.image);
    if (!other.ok()) return Fail(other.status());
    list.push_back({{"image", other->name}, {"score", candidate.score}});
  }
  return Print(list, arguments, "score");
}

int Neighbors(const NeighborArguments& arguments) {
  const auto engine = OpenToRead(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const Queries ask = (*engine)->Ask();
  const Result<ImageRecord> image = ask.FindImage(arguments.image);
  if (image.ok()) return Stored(ask, *image, arguments);
  if (image.status().code() != StatusCode::kNotFound) return Fail(image.status());
  std::error_code error;
  if (!std::filesystem::is_regular_file(arguments.image, error)) {
    return Fail(Status::NotFound("'" + arguments.image +
                                 "' is neither an image in the database nor a file"));
  }
  return Unknown(**engine, arguments);
}

}  // namespace

void RegisterNeighbors(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<NeighborArguments>();
  CLI::App* command = app->add_subcommand(
      "neighbors", "Verified neighbours of a stored photo, or ranked candidates for a new one");
  command->add_option("DB", arguments->db, "Database")->required();
  command->add_option("IMAGE", arguments->image, "A stored image's name, or a photo's path")
      ->required();
  command->add_option("--camera", arguments->camera, "Camera of a new photo, to undistort it by");
  command->add_option("--count", arguments->count, "Candidates at most (default 20)")
      ->check(CLI::Range(1, 100'000));
  command->add_flag("--json", arguments->json, "JSON");
  command->callback([=] { *exit_code = Neighbors(*arguments); });
}

}  // namespace veduta
