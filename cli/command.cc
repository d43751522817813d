// SPDX-License-Identifier: Apache-2.0
#include "cli/command.h"

#include <cstdio>

namespace veduta {

int Fail(const Status& status) {
  std::fprintf(stderr, "veduta: %s\n", status.message().c_str());
  switch (status.code()) {
    case StatusCode::kBusy:
    case StatusCode::kCorruption:
      return kDatabaseUnusable;
    default:
      return kNotDone;
  }
}

Result<std::unique_ptr<Engine>> OpenToRead(const std::string& path) {
  EngineOptions options;
  options.database.read_only = true;
  return Engine::Open(path, options);
}

Result<std::unique_ptr<Engine>> OpenToWrite(const std::string& path, EngineOptions options) {
  return Engine::Open(path, std::move(options));
}

nlohmann::ordered_json PoseJson(const Rigid3& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  const Eigen::Vector3d& t = pose.translation;
  const Eigen::Vector3d c = pose.Center();
  return {{"rotation_wxyz", {q.w(), q.x(), q.y(), q.z()}},
          {"translation", {t.x(), t.y(), t.z()}},
          {"center", {c.x(), c.y(), c.z()}}};
}

}  // namespace veduta
