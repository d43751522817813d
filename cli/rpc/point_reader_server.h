// SPDX-License-Identifier: Apache-2.0
#pragma once
// The points of a reconstruction, a chunk at a time.

#include <cstddef>
#include <memory>

#include "cli/rpc/caller.h"
#include "cli/rpc/veduta.capnp.h"

namespace veduta {

// Points in memory, which count in the budget as long as they are held.
struct HeldPoints {
  PointCloud cloud;
  std::shared_ptr<DividedShare> share;
};

// Drops them where nothing was read for 10 minutes.
class PointReaderServer final : public rpc::PointReader::Server {
 public:
  PointReaderServer(Caller caller, std::shared_ptr<const HeldPoints> points);

  kj::Promise<void> next(NextContext context) override;

 private:
  // Holds the points for a while from now on.
  void Rest();

  const Caller caller_;
  std::shared_ptr<const HeldPoints> points_;  // null: they were dropped
  const std::shared_ptr<BudgetShare> thing_;  // it is one of the session's
  size_t told_ = 0;
  kj::Promise<void> rest_ = kj::READY_NOW;
};

}  // namespace veduta
