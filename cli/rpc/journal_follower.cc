// SPDX-License-Identifier: Apache-2.0
#include "cli/rpc/journal_follower.h"

#include "cli/rpc/answer_messages.h"

namespace veduta {
namespace {

// How often a watcher hears of news, as by HTTP, and how long it may take to hear them.
constexpr kj::Duration kNewsTime = 300 * kj::MILLISECONDS, kHearTime = 60 * kj::SECONDS;

}  // namespace

Result<JournalPage> ReadJournal(const Engine& engine, const Sight& sight, uint64_t first,
                                uint32_t count) {
  const Questions ask = engine.Ask(sight);
  VEDUTA_ASSIGN_OR_RETURN(auto entries, ask.Journal(first, count));
  return JournalPage{std::move(entries), ask.snapshot()};
}

JournalFollower::JournalFollower(Caller caller, rpc::Watcher::Client watcher)
    : caller_(std::move(caller)),
      asked_(caller_.Check("GET", {"v1", "events"})),
      place_(TakeOne(caller_.session().watchers, "watchers of yours follow the city")),
      watcher_(kj::mv(watcher)) {}

kj::Promise<void> JournalFollower::Tell(uint64_t first) {
  if (!caller_.service().StillAllows(&asked_))
    return Failure(401, "the token has expired, or was revoked");
  // It may throw instead of promising, and that must reach the handler below, too.
  return kj::evalNow([this, first] {
           return caller_.Ask<JournalPage>([first, sight = asked_.sight](Engine* engine) {
             return ReadJournal(*engine, sight, first, kEntriesMax);
           });
         })
      .then(
          [this, first](const JournalPage& page) {
            return page.entries.empty() ? TellLater(first) : TellPage(page);
          },
          // Too many questions wait: that passes.
          [this, first](kj::Exception&& failure) -> kj::Promise<void> {
            if (failure.getType() != kj::Exception::Type::OVERLOADED ||
                caller_.session().is_stopping)
              return kj::mv(failure);
            return TellLater(first);
          });
}

kj::Promise<void> JournalFollower::TellLater(uint64_t first) {
  return caller_.session().timer.afterDelay(kNewsTime).then([this, first] { return Tell(first); });
}

kj::Promise<void> JournalFollower::TellPage(const JournalPage& page) {
  const uint64_t next = page.entries.back().sequence + 1;
  auto request = watcher_.entriesRequest();
  Write(page.entries, request.initEntries(static_cast<unsigned>(page.entries.size())));
  request.setNext(next);
  request.setSnapshot(page.snapshot);
  auto heard = request.send().ignoreResult().then([] { return true; });
  auto late = caller_.session().timer.afterDelay(kHearTime).then([] { return false; });
  return heard.exclusiveJoin(kj::mv(late)).then([this, next](bool in_time) {
    if (!in_time) kj::throwFatalException(Failure(408, "the watcher did not return in time"));
    return Tell(next);
  });
}

}  // namespace veduta
