// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/peer.h"

#include <algorithm>
#include <cstring>
#include <optional>

#include <fmt/format.h>
#include <linux/inet_diag.h>
#include <linux/netlink.h>
#include <linux/sock_diag.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/unique_fd.h"

namespace emberlock::daemon {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

struct Question {
  nlmsghdr head{};
  inet_diag_req_v2 socket{};
};

void write_end(__be16& port, __be32 (&address)[4], const tcp::endpoint& end) {
  port = htons(end.port());
  if (end.address().is_v4()) {
    const auto bytes = end.address().to_v4().to_bytes();
    std::memcpy(address, bytes.data(), bytes.size());
  } else {
    const auto bytes = end.address().to_v6().to_bytes();
    std::memcpy(address, bytes.data(), bytes.size());
  }
}

/// The user who owns the socket from `local` to `remote`, both on this machine, by sock_diag(7). nullopt:
/// there is no such socket, or the kernel doesn't report it.
std::optional<uid_t> user_of(const tcp::endpoint& local, const tcp::endpoint& remote) {
  const UniqueFd netlink(::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC, NETLINK_SOCK_DIAG));
  if (!netlink) return std::nullopt;
  Question question;
  question.head = {sizeof question, SOCK_DIAG_BY_FAMILY, NLM_F_REQUEST, 1, 0};
  question.socket.sdiag_family = local.address().is_v4() ? AF_INET : AF_INET6;
  question.socket.sdiag_protocol = IPPROTO_TCP;
  question.socket.idiag_states = ~0U;
  inet_diag_sockid& id = question.socket.id;
  write_end(id.idiag_sport, id.idiag_src, local);
  write_end(id.idiag_dport, id.idiag_dst, remote);
  id.idiag_cookie[0] = id.idiag_cookie[1] = INET_DIAG_NOCOOKIE;
  if (::send(netlink.get(), &question, sizeof question, 0) != sizeof question) return std::nullopt;
  alignas(nlmsghdr) char answer[4096];
  // The kernel has answered by the time send() returns.
  const ssize_t got = ::recv(netlink.get(), answer, sizeof answer, MSG_DONTWAIT);
  nlmsghdr head{};
  inet_diag_msg told{};
  if (got < static_cast<ssize_t>(NLMSG_LENGTH(sizeof told))) return std::nullopt;
  std::memcpy(&head, answer, sizeof head);
  std::memcpy(&told, answer + NLMSG_HDRLEN, sizeof told);
  // A closed socket has no user any more, and would be taken for root's.
  if (head.nlmsg_type != SOCK_DIAG_BY_FAMILY || told.idiag_inode == 0) return std::nullopt;
  return told.idiag_uid;
}

/// Converts mapped IPv4 addresses to plain ones.
tcp::endpoint plain(const tcp::endpoint& end) {
  if (!end.address().is_v6() || !end.address().to_v6().is_v4_mapped()) return end;
  return {asio::ip::make_address_v4(asio::ip::v4_mapped, end.address().to_v6()), end.port()};
}

}  // namespace

std::string peer_of(const tcp::socket& socket) {
  boost::system::error_code error;
  const tcp::endpoint remote = plain(socket.remote_endpoint(error));
  const tcp::endpoint local = error ? tcp::endpoint() : plain(socket.local_endpoint(error));
  if (error) return "gone";
  const auto address = remote.address();
  if (address.is_loopback() || address == local.address()) {
    if (const auto user = user_of(remote, local)) return fmt::format("user {}", *user);
  }
  if (address.is_v4() || address.is_loopback()) return address.to_string();
  auto network = address.to_v6().to_bytes();
  std::fill(network.begin() + 8, network.end(), static_cast<unsigned char>(0));
  return asio::ip::address_v6(network).to_string() + "/64";
}

}  // namespace emberlock::daemon
