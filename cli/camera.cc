// SPDX-License-Identifier: Apache-2.0
// veduta camera add DB NAME --size WxH --params fx,fy,cx,cy[,k1,k2[,u0,v0]]
// veduta camera add DB NAME --from FILE [--id N]
// veduta camera list DB [--json]
#include "cli/beside_daemon.h"
#include "cli/command.h"
#include "cli/wire/answers_json.h"

namespace veduta {
namespace {

struct CameraArguments {
  std::string db, name, size, params, from;
  std::optional<uint32_t> id;
  bool json = false;
};

int AddTo(const std::string& db, const std::string& name, const CameraFromFile& camera) {
  if (auto daemon = DaemonClient::Connect(db)) {
    const int exit_code = AddCameraBeside(&*daemon, name, camera.model);
    if (exit_code != kDone) return exit_code;
  } else {
    const auto engine = OpenToWrite(db);
    if (!engine.ok()) return Fail(engine.status());
    const Result<CameraId> id = (*engine)->AddCamera(name, camera.model, camera.source);
    if (!id.ok()) return Fail(id.status());
  }
  for (const std::string& message : camera.messages) {
    std::fprintf(stderr, "veduta: %s\n", Printable(message).c_str());
  }
  return kDone;
}

int AddCamera(const CameraArguments& arguments) {
  if (!arguments.from.empty()) {
    const Result<CameraFromFile> camera = ReadCameraFile(arguments.from, arguments.id);
    return camera.ok() ? AddTo(arguments.db, arguments.name, *camera) : Fail(camera.status());
  }
  if (arguments.size.empty() || arguments.params.empty()) {
    return FailUsage(
        Status::InvalidArgument("camera add wants --from FILE, or --size and --params"));
  }
  const Result<CameraModel> model = ParseCamera(arguments.size, arguments.params);
  if (!model.ok()) return FailUsage(model.status());
  return AddTo(arguments.db, arguments.name, {*model, "given on the command line", {}});
}

// What a refinement has changed; nothing where there was none.
std::string VersionText(const CameraAnswer& camera) {
  if (camera.version == 1) return {};
  std::string text = "; version " + std::to_string(camera.version);
  if (camera.focal_stddev_share) {
    char share[32];
    std::snprintf(share, sizeof(share), "%.2g", 100 * *camera.focal_stddev_share);
    text += ", its focal length to " + std::string(share) + " %";
  }
  return text;
}

int ListCameras(const CameraArguments& arguments) {
  const auto engine = OpenToRead(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const auto cameras = (*engine)->Ask().Cameras();
  if (!cameras.ok()) return Fail(cameras.status());
  if (arguments.json) {
    PrintJson(ToJson(*cameras));
    return kDone;
  }
  for (const CameraAnswer& camera : *cameras) {
    PrintLine("%s  %s  %s  (%s%s)", Printable(camera.name).c_str(),
              CameraSizeText(camera.model).c_str(), CameraParamsText(camera.model).c_str(),
              Printable(camera.source).c_str(), VersionText(camera).c_str());
  }
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
