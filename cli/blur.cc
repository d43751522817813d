// SPDX-License-Identifier: Apache-2.0
#include "cli/blur.h"

namespace veduta {

void AddBlurOption(CLI::App* command, std::string* program) {
  command
      ->add_option("--blur", *program,
                   "A program that tells which areas of a photo are private, such as faces: they "
                   "are filled before the photo is stored")
      ->check(CLI::ExistingFile);
}

}  // namespace veduta
