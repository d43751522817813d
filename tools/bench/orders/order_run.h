// SPDX-License-Identifier: Apache-2.0
#pragma once
// Adds photos in one order to a new database and asks where they were put.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "storage/base/transform.h"
#include "storage/model/camera.h"
#include "tools/bench/orders/order_list.h"

namespace veduta::orders {

struct PlacedPhoto {
  std::string name;
  uint32_t reconstruction = 0;
  Rigid3 cam_from_world;
};

// What became of one order. Where `failure` is not empty, the rest says how far it came, or
// nothing.
struct OrderRun {
  std::string label, failure;
  uint32_t photos = 0;  // in the order
  uint32_t placed = 0, postponed = 0, rejected = 0, failed = 0;
  double seconds = 0;  // wall clock of adding, and of what follows from it
  // How long the answers took that contributors waited for, each for its own photo.
  double answer_median_s = 0, answer_p99_s = 0, answer_most_s = 0;
  std::vector<PlacedPhoto> poses;
  std::string kept;  // the folder with the database, where it was kept
};

// Adds the photos one after another, as `veduta add` does, to a new database in `folder`. All were
// taken by one camera, or they tell by themselves what took them. Where there are `contributors`,
// each of them submits its share of the photos instead, the next one when the last one is answered,
// and the engine chooses whose turn it is: then two runs of an order differ. Errors stand in the
// run's `failure`.
OrderRun RunOrder(const PhotoOrder& order, const std::optional<CameraModel>& camera,
                  uint32_t threads, uint32_t contributors, const std::string& folder);

// A run as lines of text and back, exactly: from the process that ran it to the one that scores it.
// kCorruption.
std::string RunText(const OrderRun& run);
Result<OrderRun> ParseRun(const std::string& text);

}  // namespace veduta::orders
