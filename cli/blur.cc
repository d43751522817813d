// SPDX-License-Identifier: Apache-2.0
#include "cli/blur.h"

#include <unistd.h>

namespace veduta {
namespace {

std::string WhyNotStarted(const std::string& program) {
  if (access(program.c_str(), X_OK) == 0) return "";
  return "'" + program + "' cannot be started: it is not executable";
}

}  // namespace

void AddBlurOption(CLI::App* command, std::string* program) {
  command
      ->add_option("--blur", *program,
                   "A program that tells which areas of a photo are private, such as faces: they "
                   "are filled before the photo is stored")
      ->check(CLI::ExistingFile & CLI::Validator(WhyNotStarted, ""));
}

}  // namespace veduta
