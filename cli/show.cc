// SPDX-License-Identifier: Apache-2.0
// veduta show DB IMAGE [--json]; veduta pose DB IMAGE [--json]
#include "cli/command.h"
#include "engine/query/verdict_text.h"

namespace veduta {
namespace {

struct ImageArguments {
  std::string db, image;
  bool json = false;
};

// What the photo's depth map is and was made from; null where there is none.
Result<nlohmann::ordered_json> DepthJson(const Snapshot& snapshot,
                                         const std::optional<DepthRecord>& depth) {
  if (!depth) return nlohmann::ordered_json(nullptr);
  nlohmann::ordered_json sensors = nlohmann::ordered_json::array();
  for (const SensorPose& sensor : depth->sensors) {
    VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, snapshot.GetImage(sensor.image));
    sensors.push_back(image.name);
  }
  const double pixels = static_cast<double>(depth->width_px) * depth->height_px;
  return nlohmann::ordered_json{{"width", depth->width_px},
                                {"height", depth->height_px},
                                {"known_share", depth->known_count / pixels},
                                {"depth_near", depth->depth_near},
                                {"depth_far", depth->depth_far},
                                {"sensors", sensors},
                                {"geometry_version", depth->geometry_version}};
}

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

  const auto depth = ask.snapshot().dense().FindDepth(image->id);
  if (!depth.ok()) return Fail(depth.status());
  const auto depth_json = DepthJson(ask.snapshot(), *depth);
  if (!depth_json.ok()) return Fail(depth_json.status());

  nlohmann::ordered_json listed = nlohmann::ordered_json::array();
  for (const PairNeighbor& neighbor : *neighbors) {
    const Result<ImageRecord> other = ask.snapshot().GetImage(neighbor.image);
    if (!other.ok()) return Fail(other.status());
    listed.push_back({{"image", other->name},
                      {"matches", neighbor.match_count},
                      {"verdict", VerdictText(other->verdict)}});
  }
  if (arguments.json) {
    const nlohmann::ordered_json out = {{"image", image->name},
                                        {"id", image->id.value},
                                        {"verdict", VerdictText(image->verdict)},
                                        {"reason", reason},
                                        {"reconstruction", *pose ? ToJson((*pose)->reconstruction)
                                                                 : nlohmann::ordered_json(nullptr)},
                                        {"camera", image->camera.value},
                                        {"width", image->width_px},
                                        {"height", image->height_px},
                                        {"bytes", image->size_bytes},
                                        {"sha256", image->photo.Hex()},
                                        {"contributor", image->contributor},
                                        {"time", image->time_unix_s},
                                        {"features", image->feature_count},
                                        {"observations", observations->size()},
                                        {"neighbors", listed},
                                        {"depth_map", *depth_json}};
    std::printf("%s\n",
                out.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace).c_str());
    return kDone;
  }
  std::printf("%s (#%u): %s, %s\n", image->name.c_str(), image->id.value,
              VerdictText(image->verdict), reason.c_str());
  std::printf("%ux%u px, %u features, %zu of them see points", image->width_px, image->height_px,
              image->feature_count, observations->size());
  if (*pose) std::printf(" of reconstruction %u", (*pose)->reconstruction.value);
  std::printf("\n");
  if (!depth_json->is_null()) {
    std::string sensors;
    for (const auto& sensor : (*depth_json)["sensors"]) sensors += " " + sensor.get<std::string>();
    std::printf("depth map of %ux%u px, %.1f %% of it known, from%s\n",
                (*depth_json)["width"].get<uint32_t>(), (*depth_json)["height"].get<uint32_t>(),
                100 * (*depth_json)["known_share"].get<double>(), sensors.c_str());
  }
  for (const auto& neighbor : listed) {
    std::printf("  %6u matches with %s (%s)\n", neighbor["matches"].get<uint32_t>(),
                neighbor["image"].get<std::string>().c_str(),
                neighbor["verdict"].get<std::string>().c_str());
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
    return Fail(Status::NotFound(image->name + " has no pose: it is " +
                                 VerdictText(image->verdict) + ", " + ReasonText(image->reason) +
                                 (image->detail.empty() ? "" : ": " + image->detail)));
  }
  const Rigid3& cam_from_world = (*pose)->cam_from_world;
  if (arguments.json) {
    nlohmann::ordered_json out = {{"image", image->name},
                                  {"reconstruction", (*pose)->reconstruction.value}};
    out.update(PoseJson(cam_from_world));
    std::printf("%s\n",
                out.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace).c_str());
    return kDone;
  }
  const Eigen::Quaterniond& q = cam_from_world.rotation;
  const Eigen::Vector3d &t = cam_from_world.translation, c = cam_from_world.Center();
  std::printf("reconstruction %u\n", (*pose)->reconstruction.value);
  std::printf("cam_from_world rotation (w x y z) %.12g %.12g %.12g %.12g\n", q.w(), q.x(), q.y(),
              q.z());
  std::printf("translation %.12g %.12g %.12g\n", t.x(), t.y(), t.z());
  std::printf("centre %.12g %.12g %.12g\n", c.x(), c.y(), c.z());
  return kDone;
}

void RegisterImageCommand(CLI::App* app, const char* name, const char* help,
                          int (*run)(const ImageArguments&), int* exit_code) {
  auto arguments = std::make_shared<ImageArguments>();
  CLI::App* command = app->add_subcommand(name, help);
  command->add_option("DB", arguments->db, "Database")->required();
  command->add_option("IMAGE", arguments->image, "Its name, or # and its number")->required();
  command->add_flag("--json", arguments->json, "JSON");
  command->callback([=] { *exit_code = run(*arguments); });
}

}  // namespace

void RegisterShow(CLI::App* app, int* exit_code) {
  RegisterImageCommand(app, "show", "One photo: verdict, reason, reconstruction, neighbours", Show,
                       exit_code);
}

void RegisterPose(CLI::App* app, int* exit_code) {
  RegisterImageCommand(app, "pose", "Where a photo was taken", PrintPose, exit_code);
}

}  // namespace veduta
