// SPDX-License-Identifier: Apache-2.0
#include "cli/doubles.h"

#include <map>
#include <string>

namespace veduta {

void AddDoublesOption(CLI::App* command, Doubles* doubles) {
  static const std::map<std::string, Doubles> kWords = {
      {"keep", Doubles::kKeep}, {"refuse", Doubles::kRefuse}, {"better", Doubles::kBetter}};
  command
      ->add_option_function<std::string>(
          "--doubles", [doubles](const std::string& word) { *doubles = kWords.at(word); },
          "Photos that are stored once already, resized or encoded anew: keep, as any other, "
          "refuse, as duplicates, or better: the larger one is kept as the photo (default: keep)")
      ->check(CLI::IsMember({"keep", "refuse", "better"}));
}

}  // namespace veduta
