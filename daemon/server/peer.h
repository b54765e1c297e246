// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <boost/asio/ip/tcp.hpp>

namespace emberlock::daemon {

/// The client of a connection, as far as the kernel knows it: "user 1000" on this machine, else the address.
/// For IPv6, the network ("2001:db8:1:2::/64"), in which a machine can have any number of addresses.
std::string peer_of(const boost::asio::ip::tcp::socket& socket);

}  // namespace emberlock::daemon
