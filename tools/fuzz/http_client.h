// SPDX-License-Identifier: Apache-2.0
#pragma once
// One connection to a daemon on this machine, as a client has it that sends whatever it likes.

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>
#include <string_view>

#include "tools/fuzz/fuzz_target.h"

namespace veduta::fuzz {

class HttpClient final {
 public:
  explicit HttpClient(uint16_t port) : socket_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    Expect(socket_ >= 0, "there is a socket");
    // libFuzzer's own timer may interrupt it, and it goes on all the same.
    int error = 0;
    if (connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address)) != 0)
      error = errno == EINTR && Wait(POLLOUT, kHangMs) != 0 ? ErrorOfSocket() : errno;
    if (error != 0) std::fprintf(stderr, "%s\n", std::strerror(error));
    Expect(error == 0, "the daemon can be reached");
  }
  ~HttpClient() { close(socket_); }
  HttpClient(const HttpClient&) = delete;
  HttpClient& operator=(const HttpClient&) = delete;

  // Takes in meanwhile what comes, since the daemon reads no further where nobody does.
  void Send(std::string_view bytes) {
    while (!bytes.empty() && !has_ended_) {
      const int ready = Wait(POLLIN | POLLOUT, kHangMs);
      Expect(ready != 0, "the daemon goes on reading or answering");
      if ((ready & POLLIN) != 0) Receive();
      if ((ready & POLLOUT) == 0) continue;
      const ssize_t sent = send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
      if (sent >= 0) bytes.remove_prefix(static_cast<size_t>(sent));
      // It has ended the connection; what it has said before can still be read.
      if (sent < 0 && errno != EAGAIN) break;
    }
  }

  // Until so many answers have begun, or a while nothing has come.
  void Await(size_t answers) {
    while (!has_ended_ && CountOf(received_) < answers && Wait(POLLIN, kPatienceMs) != 0) Receive();
  }

  // Says that no more is to come, and reads until the daemon ends the connection, or is found to
  // tell events, of which there is no end.
  void Finish() {
    shutdown(socket_, SHUT_WR);
    while (!has_ended_ && !follows_events()) {
      Expect(Wait(POLLIN, kHangMs) != 0, "the daemon comes to an end with every connection");
      Receive();
    }
  }

  const std::string& received() const { return received_; }
  // The daemon has broken the connection off, so that what it has said may have got lost.
  bool was_cut() const { return was_cut_; }
  bool follows_events() const { return received_.find(kEvents) != received_.npos; }

  static constexpr const char* kEvents = "\r\nContent-Type: text/event-stream\r\n";
  // First lines of requests, or of answers, as they mostly look.
  static size_t CountOf(std::string_view text) {
    size_t count = 0;
    for (size_t at = text.find(kVersion); at != text.npos; at = text.find(kVersion, at + 1))
      ++count;
    return count;
  }

 private:
  static constexpr const char* kVersion = "HTTP/1.1";
  // So long nothing has come where nothing more is to be waited for. Chosen by hand: what is waited
  // for is mostly there by then, and no promise depends on it.
  static constexpr int kPatienceMs = 20;
  // And where the daemon hangs: longer than anything that it does on a small city, of which taking
  // photos out takes longest, and shorter than libFuzzer waits (tools/fuzz.sh).
  static constexpr int kHangMs = 20'000;

  // What is ready of the events; 0 where nothing is by then. libFuzzer's own timer interrupts it.
  int Wait(int events, int ms) const {
    pollfd asked{socket_, static_cast<short>(events), 0};
    int count = 0;
    do {
      count = poll(&asked, 1, ms);
    } while (count < 0 && errno == EINTR);
    return count > 0 ? asked.revents : 0;
  }
  int ErrorOfSocket() const {
    int error = 0;
    socklen_t size = sizeof(error);
    return getsockopt(socket_, SOL_SOCKET, SO_ERROR, &error, &size) == 0 ? error : errno;
  }
  void Receive() {
    char bytes[16 << 10];
    const ssize_t count = recv(socket_, bytes, sizeof(bytes), 0);
    if (count > 0) received_.append(bytes, static_cast<size_t>(count));
    has_ended_ = count <= 0;
    was_cut_ = count < 0;
  }

  const int socket_;
  std::string received_;
  bool has_ended_ = false, was_cut_ = false;
};

}  // namespace veduta::fuzz
