// SPDX-License-Identifier: Apache-2.0
#include "cli/hypotheses.h"

#include "cli/output.h"

namespace veduta {

void PrintHypothesis(const HypothesisAnswer& hypothesis) {
  PrintLine("  reconstructions %u and %u are not believed to be one: %s; judged %u times%s",
            hypothesis.a.value, hypothesis.b.value, hypothesis.reason.c_str(), hypothesis.judgments,
            hypothesis.due ? ", and to be judged anew" : "");
}

}  // namespace veduta
