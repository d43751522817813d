// SPDX-License-Identifier: Apache-2.0
#pragma once
// What stands behind the door's Questions.

#include <memory>

#include "engine/engine.h"
#include "engine/parts.h"

namespace veduta {

// One snapshot and what is asked through it.
struct Questions::View {
  std::shared_ptr<EngineParts> parts;
  std::shared_ptr<EngineCaches> caches;
  std::shared_ptr<const Snapshot> snapshot;
};

}  // namespace veduta
