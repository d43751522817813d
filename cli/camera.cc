// SPDX-License-Identifier: Apache-2.0
// veduta camera add DB NAME --size WxH --params fx,fy,cx,cy[,k1,k2[,u0,v0]]
// veduta camera add DB NAME --from FILE [--id N]
// veduta camera list DB
#include "cli/command.h"
#include "engine/calibration_door.h"

namespace veduta {
namespace {

struct CameraArguments {
  std::string db, name, size, params, from;
  std::optional<uint32_t> id;
  bool json = false;
};

Result<CameraFromFile> CameraOf(const CameraArguments& arguments) {
  if (!arguments.from.empty()) return ReadCameraFile(arguments.from, arguments.id);
  VEDUTA_ASSIGN_OR_RETURN(const CameraModel model, ParseCamera(arguments.size, arguments.params));
  return CameraFromFile{model, "given on the command line", {}};
}

int AddCamera(const CameraArguments& arguments) {
  if (arguments.from.empty() && (arguments.size.empty() || arguments.params.empty())) {
    return Fail(Status::InvalidArgument("camera add wants --from FILE, or --size and --params")),
           kBadUsage;
  }
  const auto camera = CameraOf(arguments);
  if (!camera.ok())
    return arguments.from.empty() ? (Fail(camera.status()), kBadUsage) : Fail(camera.status());
  const auto engine = OpenToWrite(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const Result<CameraId> id = (*engine)->AddCamera(arguments.name, camera->model, camera->source);
  if (!id.ok()) return Fail(id.status());
  for (const std::string& message : camera->messages)
    std::fprintf(stderr, "veduta: %s\n", message.c_str());
  return kDone;
}

int ListCameras(const CameraArguments& arguments) {
  const auto engine = OpenToRead(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const auto cameras = (*engine)->Ask().snapshot().ListCameras();
  if (!cameras.ok()) return Fail(cameras.status());
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const CameraRecord& camera : *cameras) {
    const std::string size = CameraSizeText(camera.model);
    const std::string params = CameraParamsText(camera.model);
    if (!arguments.json)
      std::printf("%s  %s  %s  (%s)\n", camera.name.c_str(), size.c_str(), params.c_str(),
                  camera.source.c_str());
    list.push_back(
        {{"name", camera.name}, {"size", size}, {"params", params}, {"source", camera.source}});
  }
  if (arguments.json) std::printf("%s\n", list.dump().c_str());
  return kDone;
}

}  // namespace

void RegisterCamera(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<CameraArguments>();
  CLI::App* camera = app->add_subcommand("camera", "The cameras that photos are taken with");
  camera->require_subcommand(1);
  CLI::App* add = camera->add_subcommand("add", "Add a calibrated camera");
  add->add_option("DB", arguments->db, "Database")->required();
  add->add_option("NAME", arguments->name, "Name to give it")->required();
  CLI::Option* size = add->add_option("--size", arguments->size, "Size of its photos, WxH in px");
  CLI::Option* params = add->add_option("--params", arguments->params,
                                        "fx,fy,cx,cy[,k1,k2[,u0,v0]]: px (centre of the top-left "
                                        "pixel is 0,0), distortion in normalised coordinates");
  CLI::Option* from = add->add_option(
      "--from", arguments->from,
      "File of the camera: from `veduta calibrate`, COLMAP's cameras.txt, or OpenCV's YAML");
  from->excludes(size)->excludes(params);
  add->add_option("--id", arguments->id, "Which camera of a cameras.txt with several")->needs(from);
  add->callback([=] { *exit_code = AddCamera(*arguments); });
  CLI::App* list = camera->add_subcommand("list", "List them");
  list->add_option("DB", arguments->db, "Database")->required();
  list->add_flag("--json", arguments->json, "JSON");
  list->callback([=] { *exit_code = ListCameras(*arguments); });
}

}  // namespace veduta
