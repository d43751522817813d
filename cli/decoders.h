// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where a command has photos decoded.

#include <CLI/CLI.hpp>
#include <string>

namespace veduta {

inline constexpr const char* kDecodersSandboxed = "sandboxed";
inline constexpr const char* kDecodersInProcess = "in-process";

// The option --decoders, one of the two.
void AddDecodersOption(CLI::App* command, std::string* decoders);

// For EngineOptions::decoder_program: the path of `veduta-decoder`, beside this program, as it is
// built, or where it is installed with it. Empty for kDecodersInProcess.
std::string DecoderProgram(const std::string& decoders);

}  // namespace veduta
