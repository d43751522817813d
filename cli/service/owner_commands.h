// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the owner of the database has the daemon do, by the socket in its folder: the commands that
// would otherwise open the database for writing, and take long.

#include <cstdint>
#include <stop_token>
#include <string>
#include <vector>

#include "cli/service/camera_keeper.h"
#include "cli/service/city_route.h"
#include "cli/service/dense_keeper.h"
#include "cli/service/http_message.h"
#include "engine/engine.h"

namespace veduta {

// Their routes, all of them `is_for_owner_alone`.
std::vector<CityRoute> OwnerRoutes();

// Thread-safe. Engine and keepers must outlive it.
class OwnerCommands final {
 public:
  // Built OpenCL programs are kept in the cache folder.
  OwnerCommands(Engine* engine, DenseKeeper* keeper, CameraKeeper* cameras,
                std::string cache_folder);

  // Does what the route stands for, and takes as long.
  HttpAnswer Answer(const HttpRequest& request);
  // Those that are at work end after the piece at hand.
  void Stop() { stop_.request_stop(); }

 private:
  HttpAnswer Do(const HttpRequest& request, const Json& wanted);
  HttpAnswer Backup(const Json& wanted);
  HttpAnswer CalibrateCameras();
  HttpAnswer Densify(const Json& wanted);
  HttpAnswer ImportModel(const Json& wanted);
  HttpAnswer Settle();
  HttpAnswer Train(const Json& wanted);

  Engine* const engine_;
  DenseKeeper* const keeper_;
  CameraKeeper* const cameras_;
  const std::string cache_folder_;
  std::stop_source stop_;
};

}  // namespace veduta
