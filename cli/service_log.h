// SPDX-License-Identifier: Apache-2.0
#pragma once
// The daemon's log: one line on standard error for each request and each photo. Tokens, queries and
// what stands for "*" in a route are in no line; names of photos are.

#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "cli/service/request_log.h"
#include "cli/wire/json.h"
#include "engine/engine.h"

namespace veduta {

enum class LogFormat : uint8_t { kNone, kText, kJson };
// As the command line names them.
std::map<std::string, LogFormat> LogFormats();

// What became of a photo; `upload` is its number in line, as requests have it.
Json PhotoLogJson(uint64_t upload, const std::string& name, const Result<AddOutcome>& outcome);
// Writes a line with the time: the object, or its members as NAME=VALUE without those that are
// null. Thread-safe.
void WriteLog(const Json& object, LogFormat format);
// Who writes requests into the log; empty where there is none.
std::function<void(const RequestEntry&)> RequestLog(LogFormat format);

}  // namespace veduta
