// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a command does with photos that are stored once already, resized or encoded anew.

#include <CLI/CLI.hpp>

#include "engine/door/engine_options.h"

namespace veduta {

// The option --doubles: keep, refuse or better.
void AddDoublesOption(CLI::App* command, Doubles* doubles);

}  // namespace veduta
