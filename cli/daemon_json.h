// SPDX-License-Identifier: Apache-2.0
#pragma once
// JSON to and from the daemon that has the database open.

#include <string>

#include "cli/service/daemon_client.h"
#include "cli/wire/json.h"
#include "storage/base/status.h"

namespace veduta {

// Why the daemon refuses, as a person reads it.
std::string DetailOf(const HttpAnswer& answer);
// A problem as RFC 9457 has it, as what the engine has said: kCorruption where `damaged` is true,
// kBusy for 503, kInvalidArgument otherwise.
Status StatusOfProblem(const Json& problem);
// The object that the daemon answers; its refusal as a failure otherwise.
Result<Json> AskForJson(DaemonClient* daemon, const DaemonClient::Question& question);
Result<Json> Post(DaemonClient* daemon, const std::string& path, const Json& json);

}  // namespace veduta
