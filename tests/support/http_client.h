// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/unique_fd.h"

namespace emberlock::test {

/// What lets tests in over HTTP: servers take it for their token, and these headers show it.
inline constexpr const char* kHttpToken = "0123456789abcdef";
inline const std::string kLetIn =
    std::string("Host: localhost\r\nAuthorization: Bearer ") + kHttpToken + "\r\n";

/// A socket to a port of this machine.
inline UniqueFd connect_to(int port) {
  UniqueFd fd(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0)
    throw std::runtime_error("nobody listens");
  return fd;
}

/// A port of this machine for a server that reuses addresses: as long as this lives no other program gets it.
class ReservedPort {
 public:
  ReservedPort() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    auto* const any = reinterpret_cast<sockaddr*>(&address);
    const int yes = 1;
    if (::setsockopt(fd_.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) != 0 ||
        ::bind(fd_.get(), any, size) != 0 || ::getsockname(fd_.get(), any, &size) != 0)
      throw std::runtime_error("no port is free");
    number_ = ntohs(address.sin_port);
  }
  [[nodiscard]] int number() const { return number_; }

 private:
  UniqueFd fd_{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
  int number_ = 0;
};

inline void send_all(const UniqueFd& socket, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(socket.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent <= 0) return;  // the server has heard enough
    bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
}

/// Until the other side ends.
inline std::string read_to_end(const UniqueFd& socket) {
  std::string all;
  char bytes[4096];
  for (ssize_t got = 0; (got = ::recv(socket.get(), bytes, sizeof(bytes), 0)) > 0;)
    all.append(bytes, static_cast<std::size_t>(got));
  return all;
}

struct HttpAnswer {
  int status = 0;
  std::string head;
  std::string body;
};

/// What a server answers to these bytes and then no more; status 0: nothing.
inline HttpAnswer ask_raw(int port, std::string_view request) {
  const UniqueFd socket = connect_to(port);
  send_all(socket, request);
  const std::string answer = read_to_end(socket);
  const std::size_t end = answer.find("\r\n\r\n");
  if (end == std::string::npos || !answer.starts_with("HTTP/1.1 ")) return {};
  return {std::stoi(answer.substr(9)), answer.substr(0, end), answer.substr(end + 4)};
}

/// `headers`: lines, each with its "\r\n"; those of who is let in unless others are given.
inline HttpAnswer ask(int port, const std::string& method, const std::string& target,
                      const std::string& body = {}, const std::string& headers = kLetIn) {
  return ask_raw(port, method + " " + target + " HTTP/1.1\r\nConnection: close\r\n" + headers +
                           "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
}

/// What an answer sets as a cookie, "NAME=VALUE"; empty: nothing.
inline std::string cookie_of(const HttpAnswer& answer) {
  constexpr std::string_view kSet = "Set-Cookie: ";
  const std::size_t at = answer.head.find(kSet);
  if (at == std::string::npos) return {};
  return answer.head.substr(at + kSet.size(), answer.head.find(';', at) - at - kSet.size());
}

}  // namespace emberlock::test
