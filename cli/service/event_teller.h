// SPDX-License-Identifier: Apache-2.0
#pragma once
// Tells those who follow the city what happens, as server-sent events.

#include <kj/async-io.h>
#include <kj/timer.h>

#include <cstdint>
#include <memory>
#include <string>

#include "cli/service/city_service.h"
#include "storage/base/status.h"

namespace veduta {

// The entry of the journal that a request for events begins with: the one after `last_event`, the
// header of one who was cut off, or else the one that the address says. kInvalidArgument where that
// is no number.
Result<uint64_t> FirstEvent(const HttpRequest& request, const std::string& last_event);

// On one thread; all that it is made of must outlive what it tells.
class EventTeller final {
 public:
  EventTeller(CityService* service, kj::Timer* timer, const bool* is_stopping)
      : service_(*service), timer_(*timer), is_stopping_(*is_stopping) {}

  // From the entry `first` on, until the token that asks is good no more, the daemon stops, or
  // cannot tell. Fails where the client goes, or does not read. `out` must live until then.
  kj::Promise<void> Tell(kj::AsyncOutputStream* out, const HttpRequest& request,
                         uint64_t first) const;

 private:
  // `silence`: what is left of it until the client hears that the line is alive.
  kj::Promise<void> TellNews(kj::AsyncOutputStream* out, uint64_t first,
                             const std::shared_ptr<HttpRequest>& asked, kj::Duration silence) const;

  CityService& service_;
  kj::Timer& timer_;
  const bool& is_stopping_;
};

}  // namespace veduta
