// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <boost/asio/ip/tcp.hpp>

namespace emberlock::daemon {

/// Who is at the other end of a connection, as far as the kernel knows: "user 1000" on this machine, else the
/// address; of IPv6 the network ("2001:db8:1:2::/64"), within which one machine has as many as it likes.
std::string peer_of(const boost::asio::ip::tcp::socket& socket);

}  // namespace emberlock::daemon
