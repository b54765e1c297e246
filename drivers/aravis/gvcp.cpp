// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/gvcp.h"

#include <array>
#include <charconv>
#include <cstring>
#include <fstream>
#include <memory>
#include <sstream>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include "base/unique_fd.h"

namespace emberlock::drivers::aravis {
namespace {

constexpr std::uint16_t kPort = 3956;
constexpr std::uint32_t kControl = 0x0a00, kControlled = 0b11;  // control, or exclusive access
constexpr std::uint32_t kPrimaryPort = 0x0a04, kPrimaryAddress = 0x0a14;
constexpr std::uint32_t kStreamPort = 0x0d00, kStreamAddress = 0x0d18;

constexpr std::uint32_t kMacHigh = 0x0008, kMacLow = 0x000c, kSerial = 0x00d8, kSerialBytes = 16;
constexpr Seconds kAnswer = milliseconds(200);

std::string dotted(std::uint32_t address) {
  const in_addr in{htonl(address)};
  std::array<char, INET_ADDRSTRLEN> text{};
  return ::inet_ntop(AF_INET, &in, text.data(), text.size()) == nullptr ? "" : text.data();
}

/// Calls `found(interface)` for each IPv4 interface with this address.
template <class Found>
void each_interface(const std::string& address, const Found& found) {
  ifaddrs* list = nullptr;
  if (::getifaddrs(&list) != 0) return;
  const std::unique_ptr<ifaddrs, decltype(&::freeifaddrs)> owner(list, &::freeifaddrs);
  for (const ifaddrs* i = list; i != nullptr; i = i->ifa_next) {
    if (i->ifa_addr == nullptr || i->ifa_addr->sa_family != AF_INET) continue;
    const auto* in = reinterpret_cast<const sockaddr_in*>(i->ifa_addr);
    if (dotted(ntohl(in->sin_addr.s_addr)) == address) found(*i);
  }
}

/// The process on this machine that owns the UDP socket with this address and port.
std::optional<Holder> owner_of(const std::string& address, std::uint16_t port) {
  bool here = false;
  each_interface(address, [&here](const ifaddrs&) { here = true; });
  if (!here) return {};
  std::ifstream table("/proc/net/udp");
  std::string line;
  std::getline(table, line);
  while (std::getline(table, line)) {
    std::istringstream words(line);
    std::string slot, local, remote, skipped;
    words >> slot >> local >> remote;
    // "0100007F:CB5B": the address in host byte order, and the port
    const auto colon = local.find(':');
    if (colon == std::string::npos) continue;
    std::uint32_t ip = 0, its_port = 0;
    std::from_chars(local.data(), local.data() + colon, ip, 16);
    std::from_chars(local.data() + colon + 1, local.data() + local.size(), its_port, 16);
    if (its_port != port || (ip != 0 && dotted(ntohl(ip)) != address)) continue;
    for (int i = 0; i < 6; ++i) words >> skipped;
    std::string inode;
    words >> inode;
    return holder_of_socket(inode);
  }
  return {};
}

/// A second address of an interface is named "eth0:1".
std::string name_of(const ifaddrs& interface) {
  return {interface.ifa_name, std::strcspn(interface.ifa_name, ":")};
}

}  // namespace

std::optional<std::uint32_t> read_register(const std::string& camera_address, std::uint32_t register_address,
                                           Seconds deadline) {
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(kPort);
  const UniqueFd fd(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (!fd || ::inet_pton(AF_INET, camera_address.c_str(), &to.sin_addr) != 1 ||
      ::connect(fd.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
    return {};
  }
  // READREG_CMD: key, flags (acknowledge), command, length, request id, address
  const std::array<std::uint16_t, 6> command{htons(0x4201),
                                             htons(0x0080),
                                             htons(4),
                                             htons(1),
                                             htons(static_cast<std::uint16_t>(register_address >> 16)),
                                             htons(static_cast<std::uint16_t>(register_address))};
  std::array<std::uint16_t, 6> answer{};
  pollfd ready{fd.get(), POLLIN, 0};
  const bool answered =
      ::send(fd.get(), command.data(), sizeof command, 0) == static_cast<ssize_t>(sizeof command) &&
      ::poll(&ready, 1, static_cast<int>(deadline.value() * 1e3)) == 1 &&
      ::recv(fd.get(), answer.data(), sizeof answer, 0) == static_cast<ssize_t>(sizeof answer);
  if (!answered || answer[0] != 0 || answer[1] != htons(0x0081) || answer[3] != command[3]) return {};
  return static_cast<std::uint32_t>(ntohs(answer[4])) << 16 | ntohs(answer[5]);
}

bool answers(const std::string& camera_address) {
  // Any register would do except the control register, whose reading some cameras take for a heartbeat.
  return read_register(camera_address, kStreamPort, milliseconds(100)).has_value();
}

std::optional<Identity> identity_at(const std::string& camera_address) {
  Identity identity;
  const auto high = read_register(camera_address, kMacHigh, kAnswer);
  const auto low = high ? read_register(camera_address, kMacLow, kAnswer) : std::nullopt;
  if (!low) return {};
  identity.mac = fmt::format("{:02x}:{:02x}:{:02x}:{:02x}:{:02x}:{:02x}", *high >> 8 & 0xff, *high & 0xff,
                             *low >> 24 & 0xff, *low >> 16 & 0xff, *low >> 8 & 0xff, *low & 0xff);
  for (std::uint32_t i = 0; i < kSerialBytes; i += 4) {
    const auto word = read_register(camera_address, kSerial + i, kAnswer);
    if (!word) return {};
    for (const int shift : {24, 16, 8, 0}) {
      const char c = static_cast<char>(*word >> shift & 0xff);
      if (c == 0) return identity;
      identity.serial += c;
    }
  }
  return identity;
}

std::optional<Controller> controller_of(const std::string& camera_address) {
  const auto ask = [&](std::uint32_t address) {
    return read_register(camera_address, address, kAnswer).value_or(0);
  };
  if ((ask(kControl) & kControlled) == 0) return {};
  // If the camera doesn't know its controller, the stream's destination is used.
  for (const auto& [address, port] :
       {std::pair(kPrimaryAddress, kPrimaryPort), {kStreamAddress, kStreamPort}}) {
    const std::uint32_t ip = ask(address);
    const auto its_port = static_cast<std::uint16_t>(ask(port));
    if (ip != 0 && its_port != 0) return Controller{dotted(ip), owner_of(dotted(ip), its_port)};
  }
  return Controller{};
}

std::optional<int> network_mtu(const std::string& interface_address) {
  std::optional<int> mtu;
  each_interface(interface_address, [&mtu](const ifaddrs& interface) {
    ifreq request{};
    const std::string name = name_of(interface);
    name.copy(request.ifr_name, IFNAMSIZ - 1);
    const UniqueFd fd(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    if (fd && ::ioctl(fd.get(), SIOCGIFMTU, &request) == 0) mtu = request.ifr_mtu;
  });
  return mtu;
}

std::optional<double> network_megabits(const std::string& interface_address) {
  std::optional<double> megabits;
  each_interface(interface_address, [&megabits](const ifaddrs& interface) {
    double speed = 0;  // unreadable if the interface is down or has no speed, like the loopback
    if (std::ifstream("/sys/class/net/" + name_of(interface) + "/speed") >> speed && speed > 0)
      megabits = speed;
  });
  return megabits;
}

}  // namespace emberlock::drivers::aravis
