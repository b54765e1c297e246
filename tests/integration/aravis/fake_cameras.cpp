// SPDX-License-Identifier: Apache-2.0
#include "tests/integration/aravis/fake_cameras.h"

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <regex>
#include <utility>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

namespace emberlock::testing_support {
namespace {

constexpr const char* kProgram = "arv-fake-gv-camera-0.8";
constexpr int kHosts = 40;

bool write_file(const char* path, const std::string& text) {
  std::ofstream out(path);
  out << text << std::flush;
  return out.good();
}

/// A network of this thread's own, and of all threads and processes that it starts. Root of its own, too,
/// where it isn't.
std::string make_network() {
  const auto uid = ::getuid(), gid = ::getgid();
  if (uid == 0 ? ::unshare(CLONE_NEWNET) != 0 : ::unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0) {
    return "this kernel or container gives no network namespaces: run as root, or allow unprivileged user "
           "namespaces (sysctl kernel.unprivileged_userns_clone=1)";
  }
  if (uid != 0) {
    write_file("/proc/self/setgroups", "deny");
    write_file("/proc/self/uid_map", "0 " + std::to_string(uid) + " 1");
    write_file("/proc/self/gid_map", "0 " + std::to_string(gid) + " 1");
  }
  std::string commands = "ip link set lo up";
  for (int host = 2; host < kHosts; ++host) {
    commands += " && ip addr add 127.0.0." + std::to_string(host) + "/8 dev lo";
  }
  if (std::system(commands.c_str()) != 0) return "`ip` failed: install iproute2 (scripts/setup does)";
  if (std::system((std::string("command -v ") + kProgram + " >/dev/null").c_str()) != 0) {
    return std::string("no ") + kProgram + ": install aravis-tools (scripts/setup does)";
  }
  return {};
}

/// Before any thread is there, as threads that are don't follow.
const std::string kWhyNoBed = make_network();

}  // namespace

const std::string& why_no_bed() { return kWhyNoBed; }

FakeCamera::FakeCamera(int host, std::string serial, int lost_per_thousand)
    : host_(host),
      serial_(std::move(serial)),
      lost_per_thousand_(lost_per_thousand),
      log_(std::filesystem::temp_directory_path() /
           ("emberlock_" + serial_ + "_" + std::to_string(::getpid()) + ".log")) {
  start();
}

void FakeCamera::start() {
  const std::string where = address(), lost = std::to_string(lost_per_thousand_);
  const pid_t parent = ::getpid();
  pid_ = ::fork();
  if (pid_ != 0) return;
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  const int log = ::open(log_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  if (log < 0 || ::getppid() != parent || ::dup2(log, 1) < 0 || ::dup2(log, 2) < 0) ::_exit(127);
  ::execlp(kProgram, kProgram, "-i", where.c_str(), "-s", serial_.c_str(), "-r", lost.c_str(), "-d",
           "stream-thread:3", nullptr);
  ::_exit(127);
}

void FakeCamera::kill() {
  if (pid_ <= 0) return;
  ::kill(pid_, SIGKILL);
  ::waitpid(std::exchange(pid_, 0), nullptr, 0);
  std::error_code ignored;
  std::filesystem::remove(log_, ignored);
}

void FakeCamera::freeze() const { ::kill(pid_, SIGSTOP); }
void FakeCamera::thaw() const { ::kill(pid_, SIGCONT); }

bool FakeCamera::listens() const {
  char bound[16];  // as the kernel lists 127.0.0.HOST, port 3956
  std::snprintf(bound, sizeof bound, "%02X00007F:0F74", static_cast<unsigned>(host_));
  std::ifstream in("/proc/net/udp");
  for (std::string line; std::getline(in, line);)
    if (line.find(bound) != std::string::npos) return true;
  return false;
}

FakeCamera::Sent FakeCamera::sent() const {
  static const std::regex sent("Send frame (\\d+)"), kept("Drop GVSP .*frame: ?(\\d+)");
  Sent all;
  std::ifstream in(log_);
  std::smatch match;
  for (std::string line; std::getline(in, line);) {
    if (std::regex_search(line, match, sent)) all.frames.push_back(std::stoull(match[1]));
    if (std::regex_search(line, match, kept)) all.incomplete.insert(std::stoull(match[1]));
  }
  return all;
}

}  // namespace emberlock::testing_support
