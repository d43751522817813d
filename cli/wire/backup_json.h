// SPDX-License-Identifier: Apache-2.0
#pragma once
// The JSON shapes of backups. docs/json.md lists every key.

#include "cli/wire/json.h"
#include "engine/engine.h"

namespace veduta {

Json ToJson(const BackupAnswer& backup);
Json ToJson(const BackupReport& report);
Json ToJson(const BackupList& list);

}  // namespace veduta
