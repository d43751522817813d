// SPDX-License-Identifier: Apache-2.0
#include "cli/service/event_teller.h"

#include <charconv>
#include <optional>
#include <utility>

#include "cli/service/piece_writer.h"
#include "cli/service/sender.h"

namespace veduta {
namespace {

// How often one who follows the city is told of news, and hears that the line is alive.
constexpr kj::Duration kNewsTime = 300 * kj::MILLISECONDS, kAliveTime = 15 * kj::SECONDS;

}  // namespace

Result<uint64_t> FirstEvent(const HttpRequest& request, const std::string& last_event) {
  uint64_t first = 0;
  const std::string text = !last_event.empty() ? last_event : Parameter(request, "from", "1");
  const auto [rest, error] = std::from_chars(text.data(), text.data() + text.size(), first);
  if (error != std::errc() || rest != text.data() + text.size())
    return Status::InvalidArgument("events are asked for as /v1/events?from=NUMBER");
  if (!last_event.empty() && first != UINT64_MAX) ++first;
  return first;
}

kj::Promise<void> EventTeller::Tell(kj::AsyncOutputStream* out, const HttpRequest& request,
                                    uint64_t first) const {
  auto asked = std::make_shared<HttpRequest>(request);
  return WriteInPieces(&timer_, out, ": veduta\n\n").then([this, out, first, asked] {
    return TellNews(out, first, asked, kAliveTime);
  });
}

kj::Promise<void> EventTeller::TellNews(kj::AsyncOutputStream* out, uint64_t first,
                                        const std::shared_ptr<HttpRequest>& asked,
                                        kj::Duration silence) const {
  if (!service_.StillAllows(asked.get())) return kj::READY_NOW;  // the token may be revoked
  // Beside the promise, of whose own value g++ 12 thinks that it may not be initialized.
  const auto told = std::make_shared<std::optional<Result<CityEvents>>>();
  auto paf = kj::newPromiseAndCrossThreadFulfiller<bool>();
  const Sender<bool> sender(kj::mv(paf.fulfiller));
  service_.TellEvents(first, asked->sight, [told, sender](Result<CityEvents> events) {
    told->emplace(std::move(events));
    sender(true);
  });
  return paf.promise.then([this, out, first, asked, silence, told](bool) -> kj::Promise<void> {
    Result<CityEvents>& events = **told;
    // A client that is cut off asks again from where it was.
    if (!events.ok() || is_stopping_) return kj::READY_NOW;
    if (!events->text.empty()) {
      auto text = kj::heap<std::string>(std::move(events->text));
      auto written = WriteInPieces(&timer_, out, *text);
      return written.attach(kj::mv(text)).then([this, out, asked, next = events->next] {
        return TellNews(out, next, asked, kAliveTime);
      });
    }
    kj::Promise<void> wait = timer_.afterDelay(kNewsTime);
    kj::Duration left = silence - kNewsTime;
    if (silence <= kNewsTime) {
      wait = wait.then([this, out] { return WriteInPieces(&timer_, out, ":\n\n"); });
      left = kAliveTime;
    }
    return wait.then([this, out, first, asked, left] { return TellNews(out, first, asked, left); });
  });
}

}  // namespace veduta
