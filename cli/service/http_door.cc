// SPDX-License-Identifier: Apache-2.0
#include "cli/service/http_door.h"

#include <kj/async-io.h>
#include <kj/compat/http.h>
#include <kj/compat/url.h>
#include <kj/debug.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <set>
#include <thread>
#include <utility>
#include <vector>

#include "cli/service/asked_work.h"
#include "cli/service/body_length.h"
#include "cli/service/body_reader.h"
#include "cli/service/connection_closer.h"
#include "cli/service/door_limits.h"
#include "cli/service/event_loop.h"
#include "cli/service/event_teller.h"
#include "cli/service/http_settings.h"
#include "cli/service/known_headers.h"
#include "cli/service/logged_response.h"
#include "cli/service/loopback.h"
#include "cli/service/own_socket.h"
#include "cli/service/piece_writer.h"
#include "cli/service/remote_address.h"
#include "cli/service/sender.h"
#include "cli/service/tus_message.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// How long a client may take for all of a body. Chosen by hand: a photo of 10 MB comes over 150
// kbit/s.
constexpr kj::Duration kBodyTime = 10 * kj::MINUTES;
// Answers that are no larger do not count among those that are being sent. Chosen by hand.
constexpr uint64_t kSmallAnswerBytes = 64 << 10;
// How long the requests at work have when the daemon stops.
constexpr kj::Duration kDrainTime = 5 * kj::SECONDS;
// Before the next connection is taken where there are too many, or taking one failed.
constexpr kj::Duration kPauseTime = 20 * kj::MILLISECONDS;

std::string Text(kj::ArrayPtr<const char> text) {
  return {text.begin(), text.size()};
}

// What the threads of the door share.
struct Limits : DoorLimits {
  explicit Limits(const HttpDoorOptions& o)
      : DoorLimits(o.bodies_bytes_max, o.answers_bytes_max, o.connections_max, o.proxies),
        options(o) {}
  const HttpDoorOptions& options;
};

// What one thread does.
class HttpDoor final : private kj::TaskSet::ErrorHandler {
 public:
  HttpDoor(CityService* service, Limits* limits, kj::Timer* timer, const kj::HttpHeaderTable& table,
           const KnownHeaders& known, bool is_of_owner)
      : service_(service),
        limits_(*limits),
        timer_(*timer),
        reader_(timer, limits->options.body_bytes_max),
        reader_of_none_(timer, 0),
        teller_(service, timer, &is_stopping_),
        taken_(is_of_owner ? &limits->connections_of_owner : &limits->connections),
        table_(table),
        known_(known),
        is_of_owner_(is_of_owner),
        server_(
            timer_, table,
            [this](kj::AsyncIoStream& connection) -> kj::Own<kj::HttpService> {
              return kj::heap<Client>(this, connection);
            },
            HttpSettings(limits->options.body_bytes_max, &closer_)),
        connections_(*this) {}

  // Takes connections for ever.
  kj::Promise<void> Accept(kj::ConnectionReceiver* port) {
    if (!taken_->Take(1)) return AcceptLater(port);
    auto place = kj::heap(kj::defer([this] { taken_->Give(1); }));
    // It may throw instead of promising, and that must reach the handler below, too.
    return kj::evalNow([port] { return port->accept(); })
        .then([this, place = kj::mv(place)](kj::Own<kj::AsyncIoStream> connection) mutable {
          auto of_address = kj::heap<DividedShare>(
              limits_.by_address, CountedSender(PeerOf(*connection), limits_.proxies));
          if (!is_of_owner_ && !of_address->Grow(1)) return;  // which closes it
          connections_.add(
              server_.listenHttp(kj::mv(connection)).attach(kj::mv(place), kj::mv(of_address)));
        })
        .then([this, port] { return Accept(port); },
              // Too many open files, mostly: that passes.
              [this, port](kj::Exception&&) { return AcceptLater(port); });
  }

  // Ends when all that is asked is answered, or late answers are given up.
  kj::Promise<void> Drain() {
    is_stopping_ = true;
    return server_.drain().exclusiveJoin(timer_.afterDelay(kDrainTime));
  }

 private:
  using Response = kj::HttpService::Response;
  // Of one connection.
  class Client final : public kj::HttpService {
   public:
    Client(HttpDoor* door, kj::AsyncIoStream& connection)
        : door_(*door), peer_(PeerOf(connection)), socket_(connection.getFd().orDefault(-1)) {}
    kj::Promise<void> request(kj::HttpMethod method, kj::StringPtr url,
                              const kj::HttpHeaders& headers, kj::AsyncInputStream& body,
                              Response& response) override {
      if (is_over_) return KJ_EXCEPTION(DISCONNECTED, "a request after the last one");
      is_over_ = ComesInChunks(headers);
      return door_.Take(peer_, socket_, method, url, headers, body, response);
    }

   private:
    HttpDoor& door_;
    const std::string peer_;
    const int socket_;
    bool is_over_ = false;  // no further request is taken
  };

  kj::Promise<void> Take(const std::string& peer, int socket, kj::HttpMethod method,
                         kj::StringPtr url, const kj::HttpHeaders& headers,
                         kj::AsyncInputStream& body, Response& response) {
    auto logged =
        kj::heap<LoggedResponse>(&response, socket, RequestId(Header(headers, known_.request_id)),
                                 service_->told_of_requests(), &closer_);
    if (logged->is_told()) logged->entry().method = kj::str(method).cStr();
    if (is_of_owner_) logged->entry().who = "owner";
    auto served = Serve(peer, method, url, headers, body, *logged);
    return served.attach(kj::mv(logged));
  }

  kj::Promise<void> Serve(const std::string& peer, kj::HttpMethod method, kj::StringPtr url,
                          const kj::HttpHeaders& headers, kj::AsyncInputStream& body,
                          LoggedResponse& response) {
    if (ComesInChunks(headers)) response.CloseAfter();
    if (auto refusal = RefuseLength(headers)) return SendLast(*std::move(refusal), response);
    auto arriving = std::make_shared<Arriving>(limits_.bodies);
    arriving->request.client = response.client();
    arriving->request.address =
        SenderAddress(peer, Header(headers, known_.forwarded_for), limits_.proxies);
    if (auto refusal = ReadHead(method, url, headers, &arriving->request))
      return Send(*std::move(refusal), response);
    HttpRequest& asked = arriving->request;
    if (response.is_told()) response.entry().route = RouteOf(asked);
    const bool is_events = asked.path == std::vector<std::string>{"v1", "events"};
    auto place = kj::heap<DividedShare>(limits_.held);
    // Before the body of a stranger is read.
    if (is_events || asked.method != "GET") {
      if (auto refusal = service_->Refuse(&asked)) return Send(*std::move(refusal), response);
      if (!asked.who.empty()) response.entry().who = asked.who;
      arriving->share->Name(HolderOf(asked));
      place->Name(HolderOf(asked));
      if (!is_of_owner_ && !place->Grow(1)) return SendLast(RefuseHolder(), response);
    }
    auto served = is_events ? Follow(asked, method == kj::HttpMethod::GET, headers, response)
                            : Receive(body, arriving, response);
    return served.attach(kj::mv(place));
  }

  static HttpAnswer RefuseHolder() {
    return ComeAgain(
        429,
        "your event streams and requests that are no questions hold half of the connections: "
        "send this one again when some of them have ended",
        5);
  }

  kj::Promise<void> Receive(kj::AsyncInputStream& body, std::shared_ptr<Arriving> arriving,
                            LoggedResponse& response) {
    const HttpRequest& asked = arriving->request;
    if (ComesInParts(asked))
      return TakeParts(body, arriving, timer_.now() + kBodyTime, std::nullopt, response);
    const bool is_question = asked.method == "GET" || asked.method == "OPTIONS";  // of anybody
    const BodyReader& reader = is_question ? reader_of_none_ : reader_;
    return timer_.timeoutAfter(kBodyTime, reader.ReadAll(body, arriving))
        .catch_([arriving](kj::Exception&& exception) {
          if (exception.getType() == kj::Exception::Type::FAILED) {
            arriving->refusal = Problem(400, "the body is no HTTP: its chunks cannot be read");
            return;
          }
          if (exception.getType() != kj::Exception::Type::OVERLOADED)
            kj::throwFatalException(kj::mv(exception));
          // kj tells short memory by the same type.
          arriving->refusal = exception.getDescription() == "operation timed out"
                                  ? Problem(408, "the body came too slowly")
                                  : ProblemOf(Status::NoMemory("there is no memory for the body"));
        })
        .then([this, arriving, &response]() -> kj::Promise<void> {
          if (arriving->refusal) return Send(*std::move(arriving->refusal), response);
          return Answer(arriving, response);
        });
  }

  std::string Header(const kj::HttpHeaders& headers, kj::HttpHeaderId id) const {
    KJ_IF_MAYBE (value, headers.get(id)) {
      return Text(*value);
    }
    return "";
  }

  // Fills all but the body. The answer where the request is not fit to be read any further.
  std::optional<HttpAnswer> ReadHead(kj::HttpMethod method, kj::StringPtr url,
                                     const kj::HttpHeaders& headers, HttpRequest* request) const {
    // Pages of others, in the browser of somebody who runs the daemon, must not reach it: by their
    // own name, or by a name of theirs that leads to this machine.
    const std::string host = Header(headers, kj::HttpHeaderId::HOST);
    const std::string origin = Header(headers, known_.origin);
    const bool by_token = limits_.options.asks_for_tokens || service_->has_tokens();
    if (!is_of_owner_ && !by_token && !IsThisMachine(HostOf(host)))
      return Problem(403, "the daemon answers to localhost, 127.0.0.1 and [::1] alone");
    const std::string site = Header(headers, known_.fetch_site);
    // A link of theirs may lead to the page itself, which tells nothing.
    const bool is_of_other_page =
        !site.empty() && site != "same-origin" && site != "none" && url != "/"_kj;
    // A proxy with TLS before the daemon hands the page on as of https.
    const bool is_own = origin.empty() || origin == "http://" + host || origin == "https://" + host;
    if (!is_of_owner_ && (is_of_other_page || !is_own))
      return Problem(403, "pages of other hosts may not ask the daemon");
    request->method = method == kj::HttpMethod::HEAD ? "GET" : kj::str(method).cStr();
    request->content_type = MediaType(Header(headers, kj::HttpHeaderId::CONTENT_TYPE));
    request->is_of_owner = is_of_owner_;
    request->token = BearerOf(Header(headers, known_.authorization));
    request->if_none_match = Header(headers, known_.none_match);
    request->prefers_async = MediaType(Header(headers, known_.prefer)).find("respond-async") == 0;
    for (const auto& [name, id] : known_.of_routes) {
      KJ_IF_MAYBE (value, headers.get(id)) {
        request->headers.emplace(name, Text(*value));
      }
    }
    auto refusal = ReadAddress(url, request);
    // For clients that cannot send every method, as the tus protocol has it.
    const std::string wanted = Header(headers, known_.method_override);
    if (!wanted.empty() && request->method == "POST" && IsTus(*request))
      request->method = wanted == "HEAD" ? "GET" : wanted;
    return refusal;
  }

  static std::optional<HttpAnswer> ReadAddress(kj::StringPtr text, HttpRequest* request) {
    KJ_IF_MAYBE (url, kj::Url::tryParse(text, kj::Url::HTTP_REQUEST)) {
      for (const kj::String& part : url->path) request->path.push_back(Text(part));
      for (const auto& [name, value] : url->query) {
        if (!request->query.emplace(Text(name), Text(value)).second)
          return Problem(400, "the parameter '" + Text(name) + "' is given twice");
      }
      return std::nullopt;
    }
    return Problem(400, "the address cannot be read");
  }

  // Hands a body over as it comes, each part as a request of its own whose Upload-Offset is where
  // the part before it has ended. What has come before the connection breaks, or takes too long,
  // is handed over as well. `so_far`: the answer to the part before.
  kj::Promise<void> TakeParts(kj::AsyncInputStream& body, std::shared_ptr<Arriving> arriving,
                              kj::TimePoint deadline, std::optional<HttpAnswer> so_far,
                              LoggedResponse& response) {
    // What the part after this one begins with.
    auto next = std::make_shared<Arriving>(limits_.bodies);
    next->request = arriving->request;
    next->share->Name(HolderOf(next->request));
    using Cut = kj::Maybe<kj::Exception>;
    return timer_.timeoutAt(deadline, reader_.ReadPart(body, arriving))
        .then([]() -> Cut { return nullptr; },
              [](kj::Exception&& exception) -> Cut { return kj::mv(exception); })
        .then([this, &body, arriving, next, deadline, so_far = std::move(so_far),
               &response](Cut cut) mutable -> kj::Promise<void> {
          if (arriving->refusal) return Send(*std::move(arriving->refusal), response);
          arriving->request.body.resize(arriving->come_bytes);
          const bool is_last = arriving->has_ended || cut != nullptr;
          if (arriving->request.body.empty() && so_far && is_last)
            return EndParts(kj::mv(cut), *std::move(so_far), response);
          return Ask(arriving).then([this, &body, next, deadline, is_last, cut = kj::mv(cut),
                                     &response](HttpAnswer answer) mutable -> kj::Promise<void> {
            if (is_last || answer.code != 204)
              return EndParts(kj::mv(cut), std::move(answer), response);
            next->request.headers["Upload-Offset"] = HeaderOf(answer, "Upload-Offset");
            return TakeParts(body, next, deadline, std::move(answer), response);
          });
        });
  }

  kj::Promise<void> EndParts(kj::Maybe<kj::Exception> cut, HttpAnswer answer,
                             LoggedResponse& response) {
    KJ_IF_MAYBE (exception, cut) {
      if (exception->getType() != kj::Exception::Type::OVERLOADED) return kj::mv(*exception);
      if (answer.code == 204) {
        HttpAnswer late = Problem(408, "the body came too slowly: what has come of it is stored");
        late.headers = std::move(answer.headers);
        answer = std::move(late);
      }
    }
    return Send(std::move(answer), response);
  }

  kj::Promise<void> Answer(std::shared_ptr<Arriving> arriving, LoggedResponse& response) {
    return Ask(std::move(arriving)).then([this, &response](HttpAnswer answer) {
      return Send(std::move(answer), response);
    });
  }

  kj::Promise<HttpAnswer> Ask(std::shared_ptr<Arriving> arriving) {
    auto paf = kj::newPromiseAndCrossThreadFulfiller<HttpAnswer>();
    const Sender<HttpAnswer> sender(kj::mv(paf.fulfiller));
    HttpRequest request = std::move(arriving->request);
    request.body_share = std::move(arriving->share);
    service_->Handle(std::move(request),
                     [sender](HttpAnswer answer) { sender(std::move(answer)); });
    return kj::mv(paf.promise);
  }

  // Closes the connection as soon as the answer is sent: nothing more of the body is read.
  kj::Promise<void> SendLast(HttpAnswer answer, LoggedResponse& response) {
    response.CloseAfter();
    return Send(std::move(answer), response).then([]() -> kj::Promise<void> {
      return KJ_EXCEPTION(DISCONNECTED, "the last answer was sent");
    });
  }

  kj::Promise<void> Send(HttpAnswer answer, LoggedResponse& response) {
    if (!answer.who.empty()) response.entry().who = answer.who;
    response.entry().upload = answer.upload;
    auto share = kj::heap<DividedShare>(limits_.answers, answer.holder);
    // One larger than all may be is sent alone.
    const uint64_t bytes =
        std::min<uint64_t>(answer.body.size(), limits_.options.answers_bytes_max);
    if (bytes > kSmallAnswerBytes && !is_of_owner_ && !share->Grow(bytes)) {
      answer = ComeAgain(
          503,
          "the answers on their way fill the memory, or yours half of it: ask again in a while", 5);
    }
    auto shared = kj::heap<HttpAnswer>(std::move(answer));
    kj::HttpHeaders headers(table_);
    if (!shared->content_type.empty() && shared->code != 304) {
      headers.set(kj::HttpHeaderId::CONTENT_TYPE, kj::StringPtr(shared->content_type.c_str()));
    }
    if (HeaderOf(*shared, "Cache-Control").empty()) headers.add("Cache-Control"_kj, "no-cache"_kj);
    headers.add("X-Content-Type-Options"_kj, "nosniff"_kj);
    for (const auto& [name, value] : shared->headers)
      headers.add(kj::StringPtr(name.c_str()), kj::StringPtr(value.c_str()));
    auto stream =
        response.send(shared->code, HttpPhrase(shared->code), headers, shared->body.size());
    auto sent = WriteInPieces(&timer_, stream.get(), shared->body);
    return sent.attach(kj::mv(stream), kj::mv(shared), kj::mv(share));
  }

  // Server-sent events, from the entry after the last one that the client has.
  kj::Promise<void> Follow(const HttpRequest& request, bool wants_body,
                           const kj::HttpHeaders& headers, LoggedResponse& response) {
    const Result<uint64_t> first = FirstEvent(request, Header(headers, known_.last_event));
    if (!first.ok()) return Send(ProblemOf(first.status()), response);
    auto place = kj::heap<DividedShare>(limits_.followers, HolderOf(request));
    if (!is_of_owner_ && !place->Grow(1)) {
      const bool is_full = limits_.followers->is_full();
      return Send(is_full ? ComeAgain(503, "too many clients follow the city: come again later", 60)
                          : ComeAgain(429,
                                      "half of all who may follow the city are you: follow it once "
                                      "more when one of your streams has ended",
                                      60),
                  response);
    }
    kj::HttpHeaders answer(table_);
    answer.set(kj::HttpHeaderId::CONTENT_TYPE, "text/event-stream"_kj);
    answer.add("Cache-Control"_kj, "no-cache"_kj);
    auto stream = response.send(200, "OK"_kj, answer);
    if (!wants_body) return kj::READY_NOW;
    auto told = teller_.Tell(stream.get(), request, *first);
    return told.attach(kj::mv(stream), kj::mv(place));
  }

  kj::Promise<void> AcceptLater(kj::ConnectionReceiver* port) {
    return timer_.afterDelay(kPauseTime).then([this, port] { return Accept(port); });
  }

  // Clients vanish, and send what is no HTTP: that ends their connection and nothing else.
  void taskFailed(kj::Exception&&) override {}

  CityService* const service_;
  Limits& limits_;
  kj::Timer& timer_;
  const BodyReader reader_, reader_of_none_;  // the latter of requests that have no body
  const EventTeller teller_;
  Budget* const taken_;  // connections
  const kj::HttpHeaderTable& table_;
  const KnownHeaders& known_;
  const bool is_of_owner_;  // no browser comes by its socket
  bool is_stopping_ = false;
  ConnectionCloser closer_;
  kj::HttpServer server_;
  kj::TaskSet connections_;
};

// Serves connections of the socket on this thread, and of the owner's unless it is -1, until a stop
// is requested. `listening` is called once they are taken, with the port.
Status ServeOnThread(CityService* service, Limits* limits, int socket, int owners,
                     std::stop_token stop, const std::function<void(uint16_t port)>& listening) {
  try {
    auto io = MakeEventLoop();
    kj::HttpHeaderTable::Builder builder;
    const KnownHeaders known(&builder);
    const kj::Own<kj::HttpHeaderTable> table = builder.build();
    auto port = io.lowLevelProvider->wrapListenSocketFd(socket);
    HttpDoor door(service, limits, &io.provider->getTimer(), *table, known, false);
    HttpDoor owners_door(service, limits, &io.provider->getTimer(), *table, known, true);
    kj::Own<kj::ConnectionReceiver> owners_port;
    if (owners >= 0) owners_port = io.lowLevelProvider->wrapListenSocketFd(owners);
    auto paf = kj::newPromiseAndCrossThreadFulfiller<bool>();
    const Sender<bool> stopped(kj::mv(paf.fulfiller));
    const std::stop_callback on_stop(stop, [&] { stopped(true); });
    if (listening) listening(static_cast<uint16_t>(port->getPort()));
    {
      const auto accepting = door.Accept(port.get()).eagerlyEvaluate(nullptr);
      kj::Promise<void> also_accepting = kj::READY_NOW;
      if (owners >= 0)
        also_accepting = owners_door.Accept(owners_port.get()).eagerlyEvaluate(nullptr);
      paf.promise.wait(io.waitScope);
    }
    service->Close();
    kj::joinPromises(kj::arr(door.Drain(), owners_door.Drain())).wait(io.waitScope);
    return Status::Ok();
  } catch (const kj::Exception& exception) {
    return Status::IoError("cannot serve at " + limits->options.address + ": " +
                           Text(exception.getDescription()));
  } catch (const std::exception& exception) {
    return Status::NoMemory(std::string("the daemon cannot go on: ") + exception.what());
  }
}

}  // namespace

Status HttpDoorOptions::Check() const {
  if (!asks_for_tokens && !IsLoopbackWithPort(address)) {
    return Status::InvalidArgument(
        "the address '" + address +
        "' must be localhost, 127.0.0.1 or [::1] with a port, since whoever reaches the daemon may "
        "do anything, until there is a token: 'veduta token create' makes one");
  }
  for (const std::string& proxy : proxies) {
    if (!PlainAddress(proxy))
      return Status::InvalidArgument("the proxy '" + proxy +
                                     "' must be an address such as 192.0.2.1 or 2001:db8::1");
  }
  return OptionBounds()
      .Between("body_bytes_max", static_cast<double>(body_bytes_max), 1, 0x1p40)
      .AtLeast("bodies_bytes_max", static_cast<double>(bodies_bytes_max),
               static_cast<double>(body_bytes_max))
      .Between("answers_bytes_max", static_cast<double>(answers_bytes_max), 1, 0x1p40)
      .Between("connections_max", connections_max, 1, 100'000)
      .Between("threads", threads, 1, 64)
      .status();
}

Status ServeHttp(CityService* service, const HttpDoorOptions& options, std::stop_token stop,
                 const std::function<void(const std::string& address)>& listening) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  VEDUTA_ASSIGN_OR_RETURN(const kj::AutoCloseFd socket, ListenAt(options.address));
  kj::AutoCloseFd owners;
  if (!options.database.empty()) {
    VEDUTA_ASSIGN_OR_RETURN(owners, ListenAtSocket(options.database));
  }
  const auto leave = kj::defer([&] {
    if (!options.database.empty()) RemoveSocket(options.database);
  });
  Limits limits(options);
  std::stop_source stopping;  // of all threads: the failure of one ends the others
  const std::stop_callback on_stop(stop, [&] { stopping.request_stop(); });
  std::vector<Status> results(options.threads);
  std::vector<std::jthread> others;
  const auto end = kj::defer([&] { stopping.request_stop(); });  // before `others` are waited for
  const auto serve = [&](size_t i, const std::function<void(uint16_t port)>& told) {
    const int also = i == 0 && !options.database.empty() ? owners.get() : -1;
    results[i] = ServeOnThread(service, &limits, socket.get(), also, stopping.get_token(), told);
    stopping.request_stop();
  };
  // The others begin when the address is told: nobody is answered before.
  serve(0, [&](uint16_t port) {
    listening(HostOf(options.address) + ":" + std::to_string(port));
    for (size_t i = 1; i < results.size(); ++i) others.emplace_back([&, i] { serve(i, {}); });
  });
  others.clear();
  for (const Status& result : results) VEDUTA_RETURN_IF_ERROR(result);
  return Status::Ok();
}

}  // namespace veduta
