// SPDX-License-Identifier: Apache-2.0
#pragma once
// Commands that write, where a daemon has the database open: they go through it.

#include <span>
#include <stop_token>
#include <string>

#include "cli/service/daemon_client.h"
#include "engine/engine.h"

namespace veduta {

// As `veduta add`: sends the photos in their order, a few ahead, and prints what becomes of each in
// the same order. A stop request sends no further one; those that were sent are placed all the
// same. The exit code.
int AddBeside(DaemonClient* daemon, std::span<const PhotoSubmission> photos, bool json,
              const std::stop_token& stop);
// As `veduta remove`, without what follows from it. The exit code.
int RemoveBeside(DaemonClient* daemon, const RemoveRequest& request, bool json);
// As `veduta forbid`, or `veduta allow`. The exit code.
int StateBeside(DaemonClient* daemon, const ForbidRequest& request, bool allows);
// As `veduta token create` and `veduta token link`, without what they print.
Result<NewToken> MakeTokenBeside(DaemonClient* daemon, const TokenRequest& request);
// As `veduta token revoke`. The exit code.
int RevokeTokenBeside(DaemonClient* daemon, uint32_t number, const std::string& actor);
// Takes surveyed points in, as `veduta georeference` does; what is known then is asked of the
// database. The answer has what the file brought alone.
Result<GeoreferenceAnswer> GeoreferenceBeside(DaemonClient* daemon,
                                              const GeoreferenceRequest& request);
// As `veduta camera add`. The exit code.
int AddCameraBeside(DaemonClient* daemon, const std::string& name, const CameraModel& model);

}  // namespace veduta
