// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos are taken out by whoever may: while no dense pass runs, and what follows is done at once.

#include <stop_token>

#include "cli/service/dense_keeper.h"
#include "cli/service/http_message.h"
#include "engine/engine.h"

namespace veduta {

// Thread-safe. Engine and keeper must outlive it.
class Removals final {
 public:
  Removals(Engine* engine, DenseKeeper* keeper) : engine_(engine), keeper_(keeper) {}

  // Does what POST /v1/removals or DELETE /v1/contributions/NUMBER stands for, and takes as long as
  // Engine::Remove and what follows from it. A dense pass is stopped only once it is known that
  // what is to be removed is there.
  HttpAnswer Answer(const HttpRequest& request);
  // Those that are at work end after the photo, or the step, at hand.
  void Stop() { stop_.request_stop(); }

 private:
  Engine* const engine_;
  DenseKeeper* const keeper_;
  std::stop_source stop_;
};

}  // namespace veduta
