// SPDX-License-Identifier: Apache-2.0
#include "cli/decoders.h"

#include <filesystem>
#include <system_error>

namespace veduta {

void AddDecodersOption(CLI::App* command, std::string* decoders) {
  command
      ->add_option("--decoders", *decoders,
                   "Where photos are decoded: sandboxed, each in a process that can do nothing "
                   "else, or in-process, where a photo that is made to do harm may do it")
      ->capture_default_str()
      ->check(CLI::IsMember({kDecodersSandboxed, kDecodersInProcess}));
}

std::string DecoderProgram(const std::string& decoders) {
  if (decoders == kDecodersInProcess) return {};
  namespace fs = std::filesystem;
  std::error_code failed;
  const fs::path folder = fs::read_symlink("/proc/self/exe", failed).parent_path();
  const fs::path beside = folder / "veduta-decoder";
  if (fs::exists(beside, failed)) return beside;
  return folder.parent_path() / "libexec" / "veduta" / "veduta-decoder";
}

}  // namespace veduta
