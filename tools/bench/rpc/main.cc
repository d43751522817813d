// SPDX-License-Identifier: Apache-2.0
// veduta-bench-rpc ADDRESS PHOTO... [--clients N] [--pipelined N] [--seconds N]
// Each client, a connection of its own, asks for poses and neighbours of the photos in turn, so
// many at a time. Prints the median, the 99th percentile and the largest latency in ms, and answers
// a second.
#include <capnp/rpc-twoparty.h>
#include <kj/async-io.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "cli/rpc/veduta.capnp.h"

namespace veduta {
namespace {

struct BenchmarkArguments {
  std::string address, token;
  std::vector<std::string> photos;
  uint32_t clients = 200, pipelined = 1, seconds = 5;
};

struct Client {
  kj::Own<kj::AsyncIoStream> stream;
  kj::Own<capnp::TwoPartyClient> connection;
  kj::Maybe<rpc::City::Client> city;
};

class Benchmark final {
 public:
  explicit Benchmark(const BenchmarkArguments& arguments)
      : arguments_(arguments), clients_(arguments.clients) {}

  void Run() {
    for (Client& client : clients_) {
      auto& network = io_.provider->getNetwork();
      auto address = network.parseAddress(arguments_.address.c_str()).wait(io_.waitScope);
      client.stream = address->connect().wait(io_.waitScope);
      client.connection = kj::heap<capnp::TwoPartyClient>(*client.stream);
      auto login = client.connection->bootstrap().castAs<rpc::Gate>().loginRequest();
      login.setToken(arguments_.token.c_str());
      client.city = login.send().wait(io_.waitScope).getCity();
    }
    const kj::TimePoint start = Now();
    end_ = start + arguments_.seconds * kj::SECONDS;
    kj::Vector<kj::Promise<void>> asking;
    for (Client& client : clients_) {
      for (uint32_t i = 0; i < arguments_.pipelined; ++i) asking.add(Ask(&client));
    }
    kj::joinPromises(asking.releaseAsArray()).wait(io_.waitScope);
    const auto taken_us = static_cast<double>((Now() - start) / kj::MICROSECONDS);
    std::ranges::sort(latencies_us_);
    const auto quantile_ms = [&](double q) {
      const auto last = static_cast<double>(latencies_us_.size() - 1);
      return static_cast<double>(latencies_us_[static_cast<size_t>(q * last)]) / 1000;
    };
    std::printf("figures %.3f %.3f %.3f %.0f\n", quantile_ms(0.5), quantile_ms(0.99),
                quantile_ms(1), 1e6 * static_cast<double>(latencies_us_.size()) / taken_us);
  }

 private:
  static kj::TimePoint Now() { return kj::systemPreciseMonotonicClock().now(); }

  // Asks again and again, until the time is over.
  kj::Promise<void> Ask(Client* client) {
    const kj::TimePoint asked = Now();
    const std::string& photo = arguments_.photos[next_ / 2 % arguments_.photos.size()];
    kj::Promise<void> answered = nullptr;
    auto& city = KJ_ASSERT_NONNULL(client->city);
    if (next_++ % 2 == 0) {
      auto request = city.poseRequest();
      request.setPhoto(photo.c_str());
      answered = request.send().ignoreResult();
    } else {
      auto request = city.neighborsRequest();
      request.setPhoto(photo.c_str());
      answered = request.send().ignoreResult();
    }
    return answered.then([this, client, asked]() -> kj::Promise<void> {
      const kj::TimePoint now = Now();
      latencies_us_.push_back((now - asked) / kj::MICROSECONDS);
      if (now >= end_) return kj::READY_NOW;
      return Ask(client);
    });
  }

  const BenchmarkArguments arguments_;
  kj::AsyncIoContext io_ = kj::setupAsyncIo();
  std::vector<Client> clients_;
  kj::TimePoint end_ = kj::origin<kj::TimePoint>();
  size_t next_ = 0;
  std::vector<int64_t> latencies_us_;
};

}  // namespace
}  // namespace veduta

int main(int count, char** words) {
  veduta::BenchmarkArguments arguments;
  CLI::App app("Questions a second by RPC");
  app.add_option("ADDRESS", arguments.address, "unix:PATH or HOST:PORT")->required();
  app.add_option("PHOTO", arguments.photos, "Photos that have a pose")->required();
  app.add_option("--token", arguments.token, "A token, where there are some");
  app.add_option("--clients", arguments.clients, "Connections")->check(CLI::Range(1, 250));
  app.add_option("--pipelined", arguments.pipelined, "Questions of each at the same time")
      ->check(CLI::Range(1, 200));
  app.add_option("--seconds", arguments.seconds, "How long")->check(CLI::Range(1, 3600));
  CLI11_PARSE(app, count, words);
  try {
    veduta::Benchmark(arguments).Run();
    return 0;
  } catch (const kj::Exception& failure) {
    std::fprintf(stderr, "%s\n", failure.getDescription().cStr());
    return 1;
  }
}
