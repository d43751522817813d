// SPDX-License-Identifier: Apache-2.0
#include "cli/rpc/point_reader_server.h"

#include <algorithm>
#include <cstring>
#include <utility>

namespace veduta {
namespace {

// How long points are held after the last time that some were read, as a connection may rest.
constexpr kj::Duration kRestTime = 10 * kj::MINUTES;

// At most and by default; chosen by hand: the daemon holds what a client has not finished with.
// Bytes of a point.
constexpr size_t kPointsMax = 4096, kPointBytes = 16;

}  // namespace

PointReaderServer::PointReaderServer(Caller caller, std::shared_ptr<const HeldPoints> points)
    : caller_(std::move(caller)),
      points_(std::move(points)),
      thing_(TakeOne(caller_.session().things, "uploads and other things are held by you")) {
  Rest();
}

void PointReaderServer::Rest() {
  rest_ = caller_.session()
              .timer.afterDelay(kRestTime)
              .then([this] { points_ = nullptr; })
              .eagerlyEvaluate(nullptr);
}

kj::Promise<void> PointReaderServer::next(NextContext context) {
  caller_.Check("GET", {"v1", "reconstructions", "1", "points"});
  if (!points_) {
    kj::throwFatalException(
        Failure(408, "no points were read for 10 minutes: ask for the reconstruction's again"));
  }
  Rest();
  const PointCloud& cloud = points_->cloud;
  const size_t wanted = context.getParams().getCount();
  const size_t count =
      std::min({wanted == 0 ? kPointsMax : wanted, kPointsMax, cloud.positions.size() - told_});
  auto bytes = context.getResults().initPoints(static_cast<unsigned>(kPointBytes * count));
  for (size_t i = 0; i < count; ++i) {
    uint8_t* const row = bytes.begin() + kPointBytes * i;
    std::memcpy(row, cloud.positions[told_ + i].data(), 12);
    std::memcpy(row + 12, cloud.rgb[told_ + i].data(), 3);
  }
  told_ += count;
  return kj::READY_NOW;
}

}  // namespace veduta
