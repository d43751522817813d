// SPDX-License-Identifier: Apache-2.0
// veduta camera add DB NAME --size WxH --params fx,fy,cx,cy[,k1,k2[,u0,v0]]
// veduta camera list DB
#include "cli/command.h"
#include "engine/camera/camera_text.h"

namespace veduta {
namespace {

struct CameraArguments {
  std::string db, name, size, params;
  bool json = false;
};

int AddCamera(const CameraArguments& arguments) {
  const Result<ImageSize> size = ParseSize(arguments.size);
  if (!size.ok()) return Fail(size.status()), kBadUsage;
  const Result<CameraModel> model = ParseCameraParams(arguments.params, *size);
  if (!model.ok()) return Fail(model.status()), kBadUsage;
  const auto engine = OpenToWrite(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const Result<CameraId> id = (*engine)->AddCamera(arguments.name, *model, "given on the command line");
  return id.ok() ? kDone : Fail(id.status());
}

int ListCameras(const CameraArguments& arguments) {
  const auto engine = OpenToRead(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const auto cameras = (*engine)->Ask().snapshot().ListCameras();
  if (!cameras.ok()) return Fail(cameras.status());
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const CameraRecord& camera : *cameras) {
    const std::string size = ImageSize{camera.model.width_px, camera.model.height_px}.Text();
    const std::string params = CameraParamsText(camera.model);
    if (!arguments.json)
      std::printf("%s  %s  %s  (%s)\n", camera.name.c_str(), size.c_str(), params.c_str(), camera.source.c_str());
    list.push_back({{"name", camera.name}, {"size", size}, {"params", params}, {"source", camera.source}});
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
  add->add_option("--size", arguments->size, "Size of its photos, WxH in px")->required();
  add->add_option(
         "--params", arguments->params,
         "fx,fy,cx,cy[,k1,k2[,u0,v0]]: px (centre of the top-left pixel is 0,0), distortion in normalised coordinates")
      ->required();
  add->callback([=] { *exit_code = AddCamera(*arguments); });
  CLI::App* list = camera->add_subcommand("list", "List them");
  list->add_option("DB", arguments->db, "Database")->required();
  list->add_flag("--json", arguments->json, "JSON");
  list->callback([=] { *exit_code = ListCameras(*arguments); });
}

}  // namespace veduta
