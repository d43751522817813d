// SPDX-License-Identifier: Apache-2.0
#pragma once
// Engine::Repair with its steps open to tests.

#include <functional>
#include <string>

#include "engine/engine.h"

namespace veduta {

// Where a repair can be stopped as if the process had been killed there.
enum class RepairStep { kSourceLinked, kExamined, kWritten, kComplete, kMovedAway };

// Called after each step; false stops there and leaves the folders as they are: kCancelled.
using RepairWatch = std::function<bool(RepairStep)>;

// As Engine::Repair.
Result<RepairAnswer> RunRepair(const std::string& path, const RepairRequest& request,
                               const RepairWatch& watch);

}  // namespace veduta
