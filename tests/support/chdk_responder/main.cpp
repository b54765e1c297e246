// SPDX-License-Identifier: Apache-2.0
// chdk_responder USBREDIR_SOCKET CONTROL_SOCKET: a Canon camera with CHDK for QEMU's usb-redir. It listens on
// both sockets until it is killed. Each connection to the first is the camera plugged in anew, switched on
// and in playback mode; its card stays. The second takes lines and answers each with "ok", "ok VALUE" or
// "error WORDS":
//   FAULT N            latency (N ms), or hang, stall, busy, wrong_transaction, long_length, short_length,
//   garbage, bad_live_view,
//                      header_alone, no_empty_packet: for the next N answers, -1 for ever
//   well               no fault any more
//   file NAME BYTES    puts a movie onto the card
//   transactions       how many it has done
//   phase              how often the phase of its shutter was drawn
//   unplug, plug       the cable, as the guest sees it
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <string>

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "base/clock.h"
#include "tests/support/chdk_responder/chdk_device.h"
#include "tests/support/chdk_responder/usbredir_line.h"

namespace emberlock::chdk_responder {
namespace {

UniqueFd listen_on(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) return {};
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  UniqueFd socket(::socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  ::unlink(path.c_str());
  if (::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::listen(socket.get(), 4) != 0) {
    return {};
  }
  return socket;
}

UniqueFd accept_on(const UniqueFd& listener) {
  return UniqueFd(::accept4(listener.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
}

class Responder {
 public:
  Responder(UniqueFd cameras, UniqueFd controls)
      : cameras_(std::move(cameras)), controls_(std::move(controls)) {}

  [[noreturn]] void run() {
    for (;;) turn();
  }

 private:
  void turn() {
    enum { kCameras, kControls, kLine, kControl };
    pollfd ready[] = {{cameras_.get(), POLLIN, 0},
                      {controls_.get(), POLLIN, 0},
                      {line_ ? line_->socket() : -1, POLLIN, 0},
                      {control_.get(), POLLIN, 0}};
    timespec wait{1, 0};
    if (line_) {
      if (line_->wants_to_write()) ready[kLine].events |= POLLOUT;
      if (const auto next = line_->next_answer()) {
        const std::int64_t ns = std::clamp<std::int64_t>(next->ns - clock_.now().ns, 0, 999'999'999);
        wait = {0, ns};
      }
    }
    ::ppoll(ready, std::size(ready), &wait, nullptr);
    if (ready[kCameras].revents != 0) {
      device_.power_on();
      line_ = std::make_unique<UsbredirLine>(accept_on(cameras_), device_, clock_);
    }
    if (ready[kControls].revents != 0) control_ = accept_on(controls_);
    if (ready[kControl].revents != 0) read_orders();
    if (line_ && !line_->serve()) line_.reset();
  }

  void read_orders() {
    char bytes[1024];
    const ssize_t n = ::read(control_.get(), bytes, sizeof bytes);
    if (n <= 0) {
      control_ = UniqueFd();
      return;
    }
    orders_.append(bytes, static_cast<std::size_t>(n));
    for (auto end = orders_.find('\n'); end != std::string::npos; end = orders_.find('\n')) {
      const std::string answer = obey(orders_.substr(0, end)) + '\n';
      orders_.erase(0, end + 1);
      if (::write(control_.get(), answer.data(), answer.size()) < 0) return;
    }
  }

  std::string obey(const std::string& line) {
    static const std::map<std::string, int Faults::*> kFaults{
        {"hang", &Faults::hang},
        {"stall", &Faults::stall},
        {"busy", &Faults::busy},
        {"wrong_transaction", &Faults::wrong_transaction},
        {"long_length", &Faults::long_length},
        {"short_length", &Faults::short_length},
        {"garbage", &Faults::garbage},
        {"bad_live_view", &Faults::bad_live_view},
        {"header_alone", &Faults::header_alone},
        {"no_empty_packet", &Faults::no_empty_packet},
    };
    std::istringstream words(line);
    std::string what;
    words >> what;
    if (const auto fault = kFaults.find(what); fault != kFaults.end()) {
      if (!(words >> device_.faults.*fault->second)) return "error how many?";
    } else if (what == "latency") {
      double ms = 0;
      if (!(words >> ms)) return "error how many milliseconds?";
      device_.faults.latency = milliseconds(ms);
    } else if (what == "well") {
      device_.faults = {};
    } else if (what == "file") {
      StoredObject file;
      file.format = 0x300a;
      if (!(words >> file.name >> file.bytes)) return "error which name, how many bytes?";
      return "ok " + std::to_string(device_.add_object(file));
    } else if (what == "transactions") {
      return "ok " + std::to_string(device_.transactions());
    } else if (what == "phase") {
      return "ok " + std::to_string(device_.phase_draws());
    } else if (what == "unplug" || what == "plug") {
      if (!line_) return "error it isn't connected";
      device_.power_on();
      what == "plug" ? line_->plug() : line_->unplug();
    } else {
      return "error unknown order";
    }
    return "ok";
  }

  UniqueFd cameras_, controls_, control_;
  SteadyClock clock_;
  Device device_{DeviceOptions{}};
  std::unique_ptr<UsbredirLine> line_;
  std::string orders_;
};

}  // namespace
}  // namespace emberlock::chdk_responder

int main(int argc, char** argv) {
  using namespace emberlock::chdk_responder;
  if (argc != 3) {
    std::fputs("usage: chdk_responder USBREDIR_SOCKET CONTROL_SOCKET\n", stderr);
    return 2;
  }
  std::signal(SIGPIPE, SIG_IGN);
  auto cameras = listen_on(argv[1]);
  auto controls = listen_on(argv[2]);
  if (!cameras || !controls) {
    std::perror("chdk_responder: can't listen");
    return 1;
  }
  Responder(std::move(cameras), std::move(controls)).run();
}
