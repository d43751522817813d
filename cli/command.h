// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the commands share: exit codes, how a failure is said, opening the database.

#include <CLI/CLI.hpp>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "engine/engine.h"

namespace veduta {

enum ExitCode : int { kDone = 0, kNotDone = 1, kBadUsage = 2, kDatabaseUnusable = 3 };

// Prints the sentence to standard error; the exit code that goes with it.
int Fail(const Status& status);

// For commands that only ask: takes no lock, so it works while another process adds.
Result<std::unique_ptr<Engine>> OpenToRead(const std::string& path);
Result<std::unique_ptr<Engine>> OpenToWrite(const std::string& path, EngineOptions options = {});

// Each adds its command to the app; running it sets *exit_code.
void RegisterInit(CLI::App* app, int* exit_code);
void RegisterCamera(CLI::App* app, int* exit_code);
void RegisterMarkers(CLI::App* app, int* exit_code);
void RegisterCalibrate(CLI::App* app, int* exit_code);
void RegisterAdd(CLI::App* app, int* exit_code);
void RegisterStatus(CLI::App* app, int* exit_code);
void RegisterShow(CLI::App* app, int* exit_code);
void RegisterNeighbors(CLI::App* app, int* exit_code);
void RegisterPose(CLI::App* app, int* exit_code);
void RegisterExport(CLI::App* app, int* exit_code);
void RegisterDensify(CLI::App* app, int* exit_code);
void RegisterRender(CLI::App* app, int* exit_code);
void RegisterVerify(CLI::App* app, int* exit_code);
void RegisterDigest(CLI::App* app, int* exit_code);
void RegisterVocabulary(CLI::App* app, int* exit_code);
void RegisterJournal(CLI::App* app, int* exit_code);
void RegisterBackup(CLI::App* app, int* exit_code);
void RegisterDevices(CLI::App* app, int* exit_code);

// null for an id that is not valid.
template <typename Tag, typename Integer>
nlohmann::ordered_json ToJson(StrongId<Tag, Integer> id) {
  return id.valid() ? nlohmann::ordered_json(id.value) : nlohmann::ordered_json(nullptr);
}
// {"rotation": quaternion w x y z, "translation": [x, y, z], "center": [x, y, z]}
nlohmann::ordered_json PoseJson(const Rigid3& cam_from_world);

}  // namespace veduta
