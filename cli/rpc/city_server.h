// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a connection of RPC is given: the gate, and behind it the city.

#include <cstdint>
#include <memory>
#include <utility>

#include "cli/rpc/caller.h"
#include "cli/rpc/veduta.capnp.h"

namespace veduta {

class GateServer final : public rpc::Gate::Server {
 public:
  explicit GateServer(std::shared_ptr<RpcSession> session) : session_(std::move(session)) {}

  kj::Promise<void> login(LoginContext context) override;

 private:
  const std::shared_ptr<RpcSession> session_;
};

class CityServer final : public rpc::City::Server {
 public:
  explicit CityServer(Caller caller);

  kj::Promise<void> status(StatusContext context) override;
  kj::Promise<void> addPhoto(AddPhotoContext context) override;
  kj::Promise<void> findUpload(FindUploadContext context) override;
  kj::Promise<void> pose(PoseContext context) override;
  kj::Promise<void> neighbors(NeighborsContext context) override;
  kj::Promise<void> examine(ExamineContext context) override;
  kj::Promise<void> reconstructions(ReconstructionsContext context) override;
  kj::Promise<void> points(PointsContext context) override;
  kj::Promise<void> journal(JournalContext context) override;
  kj::Promise<void> follow(FollowContext context) override;

 private:
  const Caller caller_;
  const std::shared_ptr<BudgetShare> thing_;  // it is one of the session's
};

}  // namespace veduta
