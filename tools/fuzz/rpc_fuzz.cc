// SPDX-License-Identifier: Apache-2.0
// A connection of the daemon's RPC: the bytes that a client sends, from the first on. The daemon is
// real, on a database of its own that is empty at first. The first byte says whether the client is
// the owner of the database.
#include <capnp/rpc.capnp.h>
#include <capnp/serialize.h>
#include <kj/async-io.h>

#include <memory>
#include <string>

#include "cli/rpc/rpc_connection.h"
#include "cli/rpc/veduta.capnp.h"
#include "cli/service/city_service.h"
#include "tools/fuzz/city_folder.h"
#include "tools/fuzz/fuzz_target.h"

namespace veduta::fuzz {
namespace {

// Photos that may wait: chosen by hand, so that a run does not fill the disk.
constexpr uint32_t kPhotosMax = 2;
// Looks, a millisecond each, at whether the calls of an input were answered.
constexpr int kLooks = 20;
// And at whether those that cannot be cancelled have ended: longer than any of them takes.
constexpr int kLastLooks = 20'000;

class Daemon final {
 public:
  Daemon() {
    ServiceOptions options;
    options.intake.photos_max = kPhotosMax;
    service_ = std::make_unique<CityService>(folder_.MakeCity(), folder_.database(), options,
                                             CityService::Listeners());
  }

  void Connect(kj::ArrayPtr<const uint8_t> bytes, bool is_of_owner) {
    kj::Timer& timer = io_.provider->getTimer();
    const RpcShared shared(service_.get(), 1, 512ull << 20);
    const bool is_stopping = false;
    const auto session = std::make_shared<RpcSession>(shared, &timer, &is_stopping, is_of_owner);
    auto pipe = kj::newTwoWayPipe();
    auto connection = kj::heap<RpcConnection>(kj::mv(pipe.ends[0]), session);
    auto running = connection->Run().eagerlyEvaluate([](kj::Exception&&) {});
    kj::AsyncIoStream& client = *pipe.ends[1];
    const auto heard = client.readAllBytes().ignoreResult().eagerlyEvaluate([](kj::Exception&&) {});
    client.write(bytes.begin(), bytes.size())
        .exclusiveJoin(running.then([&]() -> kj::Promise<void> { return kj::READY_NOW; }))
        .catch_([](kj::Exception&&) {})
        .wait(io_.waitScope);
    io_.waitScope.poll();
    for (int i = 0; i < kLooks && session->calls->used() > 0; ++i) {
      timer.afterDelay(1 * kj::MILLISECONDS).wait(io_.waitScope);
      io_.waitScope.poll();
    }
    running = kj::READY_NOW;
    connection = nullptr;
    // Cap'n Proto lets a call come to its end on which another one waits that has not begun.
    for (int i = 0; i < kLastLooks && session->things->used() + session->calls->used() > 0; ++i) {
      io_.waitScope.poll();
      timer.afterDelay(1 * kj::MILLISECONDS).wait(io_.waitScope);
    }
    Expect(session->things->used() == 0 && session->calls->used() == 0,
           "what a connection held is given back");
  }

 private:
  const CityFolder folder_{"rpc"};
  kj::AsyncIoContext io_ = kj::setupAsyncIo();
  std::unique_ptr<CityService> service_;
};

// The messages of a client, each of which asks what the ones before it have promised.
class Client final {
 public:
  Client() {
    capnp::MallocMessageBuilder message;
    message.initRoot<capnp::rpc::Message>().initBootstrap().setQuestionId(0);
    Add(&message);
  }

  // Calls what the question has promised in its first pointer, or is, where it is the bootstrap.
  template <typename Params, typename Fill>
  Client& Call(uint32_t question, uint64_t interface, uint16_t method, uint32_t of, Fill&& fill) {
    capnp::MallocMessageBuilder message;
    auto call = message.initRoot<capnp::rpc::Message>().initCall();
    call.setQuestionId(question);
    call.setInterfaceId(interface);
    call.setMethodId(method);
    auto target = call.initTarget().initPromisedAnswer();
    target.setQuestionId(of);
    if (of != 0) target.initTransform(1)[0].setGetPointerField(0);
    fill(call.initParams().getContent().template initAs<Params>());
    Add(&message);
    return *this;
  }

  std::string Sent() const { return bytes_; }

 private:
  void Add(capnp::MallocMessageBuilder* message) {
    const auto words = capnp::messageToFlatArray(*message);
    const auto bytes = words.asBytes();
    bytes_.append(reinterpret_cast<const char*>(bytes.begin()), bytes.size());
  }
  std::string bytes_ = "\x01";  // the owner
};

using rpc::City;

Client LoggedIn() {
  Client client;
  client.Call<rpc::Gate::LoginParams>(1, capnp::typeId<rpc::Gate>(), 0, 0, [](auto) {});
  return client;
}

// A question to the city whose parameters are set by `fill`.
template <typename Params, typename Fill>
std::string Question(uint16_t method, Fill&& fill) {
  return LoggedIn().Call<Params>(2, capnp::typeId<City>(), method, 1, fill).Sent();
}

std::string Photo(uint16_t sink, uint64_t interface, uint16_t asks) {
  Client client = LoggedIn();
  client.Call<City::AddPhotoParams>(2, capnp::typeId<City>(), sink, 1,
                                    [](auto params) { params.setName("a.jpg"); });
  client.Call<rpc::PhotoSink::WriteParams>(3, capnp::typeId<rpc::PhotoSink>(), 0, 2,
                                           [](auto params) { params.initChunk(9); });
  client.Call<rpc::Upload::DoneParams>(4, interface, asks, 2, [](auto) {});
  client.Call<rpc::Ticket::VerdictParams>(5, capnp::typeId<rpc::Ticket>(), 0, 4, [](auto) {});
  return client.Sent();
}

}  // namespace

std::vector<std::string> Seeds() {
  const auto nothing = [](auto) {};
  return {Client().Sent(),
          Question<City::StatusParams>(0, nothing),
          Question<City::FindUploadParams>(2, [](auto params) { params.setNumber(1); }),
          Question<City::PoseParams>(3, [](auto params) { params.setPhoto("#1"); }),
          Question<City::NeighborsParams>(4, [](auto params) { params.setPhoto("a.jpg"); }),
          Question<City::ReconstructionsParams>(6, nothing),
          Question<City::PointsParams>(7, [](auto params) { params.setReconstruction(1); }),
          Question<City::JournalParams>(8, [](auto params) { params.setFrom(1); }),
          Question<City::FollowParams>(9, [](auto params) { params.setFrom(1); }),
          Photo(1, capnp::typeId<rpc::Upload>(), 0),
          Photo(5, capnp::typeId<rpc::Examination>(), 0),
          Photo(5, capnp::typeId<rpc::Examination>(), 1)};
}

}  // namespace veduta::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static veduta::fuzz::Daemon daemon;
  if (size > 0) daemon.Connect(kj::arrayPtr(data + 1, size - 1), (data[0] & 1) != 0);
  return 0;
}
