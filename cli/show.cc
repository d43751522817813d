// SPDX-License-Identifier: Apache-2.0
// veduta show DB IMAGE [--json]; veduta pose DB IMAGE [--json]
#include "cli/command.h"
#include "engine/verdict_text.h"

namespace veduta {
namespace {

struct ImageArguments {
  std::string db, image;
  bool json = false;
};

int Show(const ImageArguments& arguments) {
  const auto engine = OpenToRead(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const Queries ask = (*engine)->Ask();
  const Result<ImageRecord> image = ask.FindImage(arguments.image);
  if (!image.ok()) return Fail(image.status());
  const auto pose = ask.Pose(image->id);
  if (!pose.ok()) return Fail(pose.status());
  const auto neighbors = ask.Neighbors(image->id);
  if (!neighbors.ok()) return Fail(neighbors.status());
  const auto observations = ask.snapshot().GetObservations(image->id);
  if (!observations.ok()) return Fail(observations.status());
  const std::string reason =
      std::string(ReasonText(image->reason)) + (image->detail.empty() ? "" : ": " + image->detail);

  nlohmann::ordered_json listed = nlohmann::ordered_json::array();
  for (const PairNeighbor& neighbor : *neighbors) {
    const Result<ImageRecord> other = ask.snapshot().GetImage(neighbor.image);
    if (!other.ok()) return Fail(other.status());
    listed.push_back(
        {{"image", other->name}, {"matches", neighbor.match_count}, {"verdict", VerdictText(other->verdict)}});
  }
  if (arguments.json) {
    const nlohmann::ordered_json out = {
        {"image", image->name},
        {"id", image->id.value},
        {"verdict", VerdictText(image->verdict)},
        {"reason", reason},
        {"reconstruction", *pose ? ToJson((*pose)->reconstruction) : nlohmann::ordered_json(nullptr)},
        {"camera", image->camera.value},
        {"width", image->width_px},
        {"height", image->height_px},
        {"bytes", image->size_bytes},
        {"sha256", image->photo.Hex()},
        {"contributor", image->contributor},
        {"time", image->time_unix_s},
        {"features", image->feature_count},
        {"observations", observations->size()},
        {"neighbors", listed}};
    std::printf("%s\n", out.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace).c_str());
    return kDone;
  }
  std::printf("%s (#%u): %s, %s\n", image->name.c_str(), image->id.value, VerdictText(image->verdict), reason.c_str());
  std::printf("%ux%u px, %u features, %zu of them see points", image->width_px, image->height_px, image->feature_count,
              observations->size());
  if (*pose) std::printf(" of reconstruction %u", (*pose)->reconstruction.value);
  std::printf("\n");
  for (const auto& neighbor : listed) {
    std::printf("  %6u matches with %s (%s)\n", neighbor["matches"].get<uint32_t>(),
                neighbor["image"].get<std::string>().c_str(), neighbor["verdict"].get<std::string>().c_str());
  }
  return kDone;
}

int PrintPose(const ImageArguments& arguments) {
  const auto engine = OpenToRead(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const Queries ask = (*engine)->Ask();
  const Result<ImageRecord> image = ask.FindImage(arguments.image);
  if (!image.ok()) return Fail(image.status());
  const auto pose = ask.Pose(image->id);
  if (!pose.ok()) return Fail(pose.status());
  if (!*pose) {
    return Fail(Status::NotFound(image->name + " has no pose: it is " + VerdictText(image->verdict) + ", " +
                                 ReasonText(image->reason) + (image->detail.empty() ? "" : ": " + image->detail)));
  }
  const Rigid3& cam_from_world = (*pose)->cam_from_world;
  if (arguments.json) {
    nlohmann::ordered_json out = {{"image", image->name}, {"reconstruction", (*pose)->reconstruction.value}};
    out.update(PoseJson(cam_from_world));
    std::printf("%s\n", out.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace).c_str());
    return kDone;
  }
  const Eigen::Quaterniond& q = cam_from_world.rotation;
  const Eigen::Vector3d &t = cam_from_world.translation, c = cam_from_world.Center();
  std::printf("reconstruction %u\n", (*pose)->reconstruction.value);
  std::printf("cam_from_world rotation (w x y z) %.12g %.12g %.12g %.12g\n", q.w(), q.x(), q.y(), q.z());
  std::printf("translation %.12g %.12g %.12g\n", t.x(), t.y(), t.z());
  std::printf("centre %.12g %.12g %.12g\n", c.x(), c.y(), c.z());
  return kDone;
}

void RegisterImageCommand(CLI::App* app, const char* name, const char* help, int (*run)(const ImageArguments&),
                          int* exit_code) {
  auto arguments = std::make_shared<ImageArguments>();
  CLI::App* command = app->add_subcommand(name, help);
  command->add_option("DB", arguments->db, "Database")->required();
  command->add_option("IMAGE", arguments->image, "Its name, or # and its number")->required();
  command->add_flag("--json", arguments->json, "JSON");
  command->callback([=] { *exit_code = run(*arguments); });
}

}  // namespace

void RegisterShow(CLI::App* app, int* exit_code) {
  RegisterImageCommand(app, "show", "One photo: verdict, reason, reconstruction, neighbours", Show, exit_code);
}

void RegisterPose(CLI::App* app, int* exit_code) {
  RegisterImageCommand(app, "pose", "Where a photo was taken", PrintPose, exit_code);
}

}  // namespace veduta
