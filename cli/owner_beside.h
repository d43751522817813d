// SPDX-License-Identifier: Apache-2.0
#pragma once
// Commands that take long, where a daemon has the database open: it does the work, with its own
// threads, and goes on with it where the command is ended. What is told is what is told without a
// daemon, but when all is done.

#include <functional>
#include <string>

#include "cli/service/daemon_client.h"
#include "cli/wire/json.h"
#include "engine/engine.h"

namespace veduta {

// As Engine::CalibrateWaiting, and puts the photos in line; `found` is told the FirstCameraText of
// each camera.
Status CalibrateBeside(DaemonClient* daemon, const std::function<void(const std::string&)>& found);
// Waits for the photos that wait for their turn now. `placed` is told what `veduta add --json`
// prints of each; a failure is printed, and the last one is returned. One whose camera cannot be
// told yet is printed, too, and waits on.
Status WaitForUploads(DaemonClient* daemon, const std::function<void(const Json&)>& placed);
// As Engine::Settle.
Status SettleBeside(DaemonClient* daemon, const std::function<void(const FollowUp&)>& followed);
// As Engine::TrainVocabulary and Engine::ImportVocabulary; the daemon reads the file.
Status TrainBeside(DaemonClient* daemon, const VocabularyRequest& request);
Status ImportBeside(DaemonClient* daemon, const std::string& file);
// As Engine::Import; the daemon reads the model and the photos.
Result<ImportAnswer> ImportModelBeside(DaemonClient* daemon, const ImportRequest& request,
                                       const std::function<void(const AddOutcome&)>& failed,
                                       const std::function<void(const FollowUp&)>& followed);
// As Engine::Copy and Engine::Backup; the daemon writes the folder.
Status CopyBeside(DaemonClient* daemon, const std::string& out);
Result<BackupReport> BackupBeside(DaemonClient* daemon, const BackupRequest& request);
// As Engine::Densify, to the report that the request has, for so many hours (PassTime).
Status DensifyBeside(DaemonClient* daemon, const DensifyRequest& request, double hours);

// Says that the daemon has its own number of threads, where another one was asked for.
void WarnOfThreads(uint32_t threads);

}  // namespace veduta
