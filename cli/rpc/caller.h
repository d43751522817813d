// SPDX-License-Identifier: Apache-2.0
#pragma once
// Who calls by a connection of RPC, and what such a connection may have at the same time.

#include <kj/async.h>
#include <kj/timer.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/rpc/rpc_failure.h"
#include "cli/service/asked_work.h"
#include "cli/service/budget.h"
#include "cli/service/city_service.h"
#include "cli/service/divided_budget.h"
#include "cli/service/sender.h"
#include "storage/base/memory_shortage.h"

namespace veduta {

// The largest photo. Chosen by hand, as that of HTTP.
inline constexpr uint64_t kRpcPhotoBytesMax = 128ull << 20;

// What all connections share.
struct RpcShared {
  RpcShared(CityService* s, uint64_t connections_max, uint64_t bytes_max)
      : service(s),
        bytes(std::make_shared<DividedBudget>(bytes_max)),
        connections(std::make_shared<Budget>(connections_max)),
        by_address(std::make_shared<DividedBudget>(connections_max)),
        by_holder(std::make_shared<DividedBudget>(connections_max)) {}
  CityService* const service;
  const std::shared_ptr<DividedBudget> bytes;
  const std::shared_ptr<Budget> connections;
  const std::shared_ptr<DividedBudget> by_address;  // connections of strangers
  const std::shared_ptr<DividedBudget> by_holder;   // those on which they have logged in
};

// One connection. On its thread alone.
struct RpcSession {
  // At the same time: questions that the service works on, of the 256 that may wait there in all;
  // verdicts that are waited for; things that the daemon holds for the client (uploads, tickets,
  // ...); watchers. Chosen by hand.
  static constexpr uint64_t kCallsMax = 64, kVerdictsMax = 1024, kThingsMax = 1024,
                            kWatchersMax = 8;

  RpcSession(const RpcShared& all, kj::Timer* t, const bool* stopping, bool of_owner)
      : shared(all), timer(*t), is_stopping(*stopping), is_of_owner(of_owner) {}

  const RpcShared shared;
  kj::Timer& timer;
  const bool& is_stopping;  // the daemon is
  const bool is_of_owner;   // it came by a socket that the owner of the database alone can reach
  bool has_logged_in = false;
  DividedShare place{shared.by_holder};  // of whoever has logged in first
  const std::shared_ptr<Budget> calls = std::make_shared<Budget>(kCallsMax);
  const std::shared_ptr<Budget> verdicts = std::make_shared<Budget>(kVerdictsMax);
  const std::shared_ptr<Budget> things = std::make_shared<Budget>(kThingsMax);
  const std::shared_ptr<Budget> watchers = std::make_shared<Budget>(kWatchersMax);
  // Ends when all photos that are complete by now are on the disk, or refused: each is put there
  // after those before it, so that their order is the client's.
  kj::Promise<void> stored = kj::READY_NOW;
};

// One of what `budget` counts, as long as it is held; 429 is thrown where there are too many, of
// which `what` says what they are.
std::shared_ptr<BudgetShare> TakeOne(const std::shared_ptr<Budget>& budget, const char* what);

// Somebody who logs in, or has done so. Copies stand for the same one.
class Caller final {
 public:
  Caller(std::shared_ptr<RpcSession> session, std::string token)
      : session_(std::move(session)), token_(std::move(token)) {}

  RpcSession& session() const { return *session_; }
  CityService& service() const { return *session_->shared.service; }

  // Notes whose token it is. Throws where it is not let in: it may ask what the least of all roles
  // may, as Check has it; and 429 where half of the connections are the caller's already.
  void LogIn();

  // Throws where the caller may not make the request of HTTP that asks for the same: the table of
  // routes is that of both. Otherwise that request, with whose token it is; each counts in the
  // token's quota.
  HttpRequest Check(const char* method, std::vector<std::string> path,
                    const std::string& contributor = "") const;

  // An empty share of the bytes that all connections have, which counts as the caller's.
  std::shared_ptr<DividedShare> NewShare() const;

  // What `ask` says, by a thread for such work, while this one goes on. `ask` must hold all that it
  // needs. Long work of a call that was cancelled is not begun.
  template <typename T>
  kj::Promise<T> Ask(std::function<Result<T>(Engine* engine)> ask,
                     WorkKind kind = WorkKind::kShort) const {
    auto call = TakeOne(session_->calls, "calls wait for their answers");
    // Beside the promise, of whose own value g++ 12 thinks that it may not be initialized.
    const auto answer = std::make_shared<std::optional<Result<T>>>();
    auto paf = kj::newPromiseAndCrossThreadFulfiller<bool>();
    const Sender<bool> sender(kj::mv(paf.fulfiller));
    const auto client = std::make_shared<ClientPresence>();
    WorkOwner owner{AskerOf(Asking())};
    if (kind == WorkKind::kLong) owner.client = client;
    service().Run(
        kind, std::move(owner),
        [sender, answer, ask = std::move(ask)](Engine* engine, const Status& refusal) {
          answer->emplace(refusal.ok() ? CatchShortage("answer a call", [&] { return ask(engine); })
                                       : Result<T>(refusal));
          sender(true);
        });
    return paf.promise.then([call, answer](bool) { return ValueOrThrow(std::move(**answer)); })
        .attach(kj::defer([client] { client->Leave(); }));
  }

 private:
  // Whose requests they are, and nothing else: for AskerOf and HolderOf.
  HttpRequest Asking() const;

  std::shared_ptr<RpcSession> session_;
  std::string token_;
  uint32_t token_number_ = 0;  // 0: there is none
};

}  // namespace veduta
