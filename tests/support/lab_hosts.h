// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include <fcntl.h>
#include <sched.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/quantity.h"
#include "base/time_point.h"
#include "base/unique_fd.h"
#include "session/camera_reader.h"
#include "session/reader.h"
#include "tests/support/certificate.h"
#include "tests/support/shell.h"
#include "tests/support/wait.h"

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
    const UniqueFd file(
        ::open(("/var/run/netns/" + name(std::to_string(host))).c_str(), O_RDONLY | O_CLOEXEC));
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

inline void write_private(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file) << text;
  std::filesystem::permissions(file,
                               std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
}

/// One host: its network, its clock, its folder, its simulated cameras and its emberlockd. Number 0 leads.
class LabHost {
 public:
  struct Setup {
    std::filesystem::path folder;  ///< of all hosts
    int number = 0;
    int cameras = 2;
    std::string size = "160x120";
  };
  struct Programs {
    std::string emberlockd;
    std::string emberlock;
  };

  LabHost(const Setup& setup, const HostNetwork& network, const CertificateAuthority& authority,
          Programs programs)
      : setup_(setup),
        folder_(setup.folder / ("host-" + std::to_string(setup.number))),
        network_(network),
        programs_(std::move(programs)) {
    std::filesystem::create_directories(folder_);
    const rig::TlsIdentity own = authority.issue(HostNetwork::address(setup.number));
    write_private(folder_ / "host.crt", own.certificate);
    write_private(folder_ / "host.key", own.key);
    write_private(folder_ / "hosts.crt", authority.pem());
    cameras_ = "[rig]\nname = \"dome\"\n[[rig.camera]]\ndriver = \"virtual\"\nid = \"" + letter() +
               "\"\ncount = " + std::to_string(setup.cameras) + "\nsize = \"" + setup.size + "\"\n";
    rest_ = "[rig.virtual]\nlight = \"" + (setup.folder / "light").string() + "\"\n[recording]\nfolder = \"" +
            sessions().string() +
            "\"\nfree_space_floor_mib = 0\nencoding = \"raw\"\ntranscode = \"never\"\n[server]\nsocket = \"" +
            (folder_ / "run" / "d.sock").string() +
            "\"\nhttp_listen = \"\"\n[hosts]\ncertificate = \"host.crt\"\nkey = \"host.key\"\n"
            "authority = \"hosts.crt\"\n";
  }
  LabHost(const LabHost&) = delete;
  LabHost& operator=(const LabHost&) = delete;
  ~LabHost() { kill(); }

  /// Its monotonic clock is so much ahead of the machine's.
  [[nodiscard]] Seconds ahead() const { return Seconds(1000.0 * setup_.number); }
  [[nodiscard]] std::filesystem::path sessions() const { return folder_ / "sessions"; }
  [[nodiscard]] std::string address() const { return HostNetwork::address(setup_.number) + ":7143"; }
  void lends() { rest_ += "listen = \"" + address() + "\"\n"; }
  void leads(const std::vector<std::unique_ptr<LabHost>>& others) {
    for (const auto& other : others)
      for (int i = 0; i < other->setup_.cameras; ++i)
        cameras_ += "[[rig.camera]]\ndriver = \"remote\"\nhost = \"" + other->address() + "\"\nid = \"" +
                    other->letter() + "-0" + std::to_string(i) + "\"\n";
    cameras_ += "[rig.strobe]\ndriver = \"virtual\"\n";
  }
  void start() {
    write_private(folder_ / "d.toml", cameras_ + rest_);
    pid_ = ::fork();
    if (pid_ != 0) return;
    network_.enter(setup_.number);
    const std::string ahead = std::to_string(std::llround(this->ahead().value()));
    const std::string config = (folder_ / "d.toml").string();
    ::execlp("unshare", "unshare", "--time", "--monotonic", ahead.c_str(), "--fork", "--kill-child",
             programs_.emberlockd.c_str(), "--config", config.c_str(), nullptr);
    ::_exit(127);
  }
  /// The program that made its clock goes first, and takes it along.
  void kill() {
    if (pid_ <= 0) return;
    const std::string pid = std::to_string(pid_);
    std::string daemon;
    std::ifstream("/proc/" + pid + "/task/" + pid + "/children") >> daemon;
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
    pid_ = -1;
    wait_until([&] { return daemon.empty() || !std::filesystem::exists("/proc/" + daemon); });
  }
  [[nodiscard]] Shell client(const std::string& words) const {
    return shell(programs_.emberlock + " " + words +
                 " --daemon unix:" + (folder_ / "run" / "d.sock").string());
  }
  /// Asks until the answer has `words`.
  [[nodiscard]] bool answers(const std::string& question, const std::string& words) const {
    return wait_until([&] { return client(question).output.find(words) != std::string::npos; });
  }
  /// Frames of its first camera that a session's index has so far.
  [[nodiscard]] std::size_t recorded(const std::string& session) const {
    const auto index = session::read_index(sessions() / session, letter() + "-00");
    return index.ok() ? index->records.size() : 0;
  }
  /// Waits until a session has so many frames of its first camera.
  [[nodiscard]] bool records(const std::string& session, std::size_t frames) const {
    return wait_until([&] { return recorded(session) >= frames; });
  }

 private:
  [[nodiscard]] std::string letter() const { return std::string(1, static_cast<char>('a' + setup_.number)); }

  Setup setup_;
  std::filesystem::path folder_;
  const HostNetwork& network_;
  Programs programs_;
  std::string cameras_;
  std::string rest_;
  pid_t pid_ = -1;
};

/// Between the first and the last of all hosts' cameras, as their frames arrived when a session began:
/// simulated ones stamp a frame with the very instant at which its read phase ended.
inline Seconds true_worst_pair(const std::vector<const LabHost*>& hosts, const std::string& session,
                               Hertz rate) {
  std::optional<TimePoint> first;
  Seconds earliest, latest;
  for (const LabHost* host : hosts) {
    const auto reader = session::SessionReader::open(host->sessions() / session);
    if (!reader) throw std::runtime_error(reader.error().message());
    for (std::size_t i = 0; i < reader->camera_count(); ++i) {
      const TimePoint at = reader->stamps(i).at(0).monotonic_time - host->ahead();
      first = first.value_or(at);
      const Seconds late = wrap_symmetric(at - *first, period(rate));
      earliest = std::min(earliest, late);
      latest = std::max(latest, late);
    }
  }
  return latest - earliest;
}

}  // namespace emberlock::test
