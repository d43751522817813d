// SPDX-License-Identifier: Apache-2.0
#include "cli/hypotheses.h"

#include <string>

#include "cli/output.h"

namespace veduta {

void PrintHypothesis(const HypothesisAnswer& hypothesis) {
  const std::string times =
      hypothesis.judgments == 1 ? "once" : std::to_string(hypothesis.judgments) + " times";
  const size_t unsure = hypothesis.unsure.size();
  const std::string photos = unsure == 0 ? ""
                                         : "; " + std::to_string(unsure) +
                                               (unsure == 1 ? " photo" : " photos") +
                                               " may stand on either side";
  PrintLine("  reconstructions %u and %u are not believed to be one: %s; judged %s%s%s",
            hypothesis.a.value, hypothesis.b.value, hypothesis.reason.c_str(), times.c_str(),
            hypothesis.due ? ", and to be judged anew" : "", photos.c_str());
}

}  // namespace veduta
