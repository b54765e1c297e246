// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include <fcntl.h>
#include <sched.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/unique_fd.h"
#include "tests/support/shell.h"

namespace emberlock::test {

/// Hosts on a switch, each a network namespace: host i has the address 10.77.0.(i + 1). Needs root.
class HostNetwork {
 public:
  explicit HostNetwork(int hosts) : prefix_("em" + std::to_string(::getpid()) + "-") {
    run("ip netns add " + name("hub"));
    in("hub", "ip link add br0 type bridge");
    in("hub", "ip link set br0 up");
    for (int i = 0; i < hosts; ++i) {
      const std::string host = std::to_string(i);
      run("ip netns add " + name(host));
      in("hub", "ip link add port" + host + " type veth peer name eth0 netns " + name(host));
      in("hub", "ip link set port" + host + " master br0 up");
      in(host, "ip address add " + address(i) + "/24 dev eth0");
      in(host, "ip link set lo up");
      in(host, "ip link set eth0 up");
      hosts_.push_back(host);
    }
  }
  HostNetwork(const HostNetwork&) = delete;
  HostNetwork& operator=(const HostNetwork&) = delete;
  ~HostNetwork() {
    for (const std::string& host : hosts_) static_cast<void>(shell("ip netns del " + name(host)));
    static_cast<void>(shell("ip netns del " + name("hub")));
  }

  /// Whether all of it could be made.
  [[nodiscard]] const std::string& trouble() const { return trouble_; }
  [[nodiscard]] static std::string address(int host) { return "10.77.0." + std::to_string(host + 1); }
  void cut_off(int host) { in("hub", "ip link set port" + std::to_string(host) + " down"); }
  void connect(int host) { in("hub", "ip link set port" + std::to_string(host) + " up"); }
  /// In a child process, before it runs a program.
  void enter(int host) const {
    const UniqueFd file(::open(("/var/run/netns/" + name(std::to_string(host))).c_str(), O_RDONLY | O_CLOEXEC));
    if (!file || ::setns(file.get(), CLONE_NEWNET) != 0) ::_exit(126);
  }

 private:
  [[nodiscard]] std::string name(const std::string& host) const { return prefix_ + host; }
  void in(const std::string& host, const std::string& command) {
    run("ip netns exec " + name(host) + " " + command);
  }
  void run(const std::string& command) {
    const Shell done = shell(command);
    if (done.status != 0 && trouble_.empty()) trouble_ = command + ": " + done.output;
  }

  std::string prefix_;
  std::vector<std::string> hosts_;
  std::string trouble_;
};

}  // namespace emberlock::test
