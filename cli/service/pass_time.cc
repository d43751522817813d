// SPDX-License-Identifier: Apache-2.0
#include "cli/service/pass_time.h"

#include <cstdio>
#include <string>

namespace veduta {

void PassTime::Look() {
  const std::chrono::duration<double, std::ratio<3600>> passed =
      std::chrono::steady_clock::now() - begin_;
  if (hours_ == 0 || passed.count() < hours_ || stop_.stop_requested()) return;
  is_over_ = true;
  stop_.request_stop();
}

Status PassTimeIsOver(double hours) {
  char text[32];
  std::snprintf(text, sizeof(text), "%g", hours);
  return Status::Cancelled("stopped after " + std::string(text) +
                           " hours: what is finished is stored, and the same command goes on");
}

}  // namespace veduta
