// SPDX-License-Identifier: Apache-2.0
#pragma once
// Whether a command has what is private in photos filled before they are stored.

#include <CLI/CLI.hpp>
#include <string>

namespace veduta {

// The option --blur, for EngineOptions::blur_command.
void AddBlurOption(CLI::App* command, std::string* program);

}  // namespace veduta
