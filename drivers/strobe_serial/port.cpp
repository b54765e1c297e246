// SPDX-License-Identifier: Apache-2.0
#include "drivers/strobe_serial/port.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <regex>

#include <fmt/format.h>
#include <libserialport.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>

#include "drivers/holder.h"

namespace emberlock::drivers::strobe_serial {
namespace {

struct FreePort {
  void operator()(sp_port* port) const { sp_free_port(port); }
};
using PortHandle = std::unique_ptr<sp_port, FreePort>;

std::string text(const char* s) { return s != nullptr ? s : ""; }

std::string last_error() {
  char* message = sp_last_error_message();
  std::string copy = text(message);
  if (message != nullptr) sp_free_error_message(message);
  return copy;
}

/// The place of a USB port's interface, "usb-0000:00:14.0-1.2:1.0", from its sysfs path. Contains the host
/// controller's address, because bus numbers depend on the order of discovery.
std::string usb_place(const std::string& name) {
  static const std::regex bus("usb[0-9]+"), interface("[0-9]+(-[0-9.]+:[0-9]+\\.[0-9]+)");
  std::error_code none;
  std::string place, controller, last;
  for (const auto& part : std::filesystem::canonical("/sys/class/tty/" + name + "/device", none)) {
    std::smatch found;
    const std::string folder = part;
    if (std::regex_match(folder, bus)) controller = last;
    if (std::regex_match(folder, found, interface)) place = "usb-" + controller + found[1].str();
    last = folder;
  }
  return place;
}

unsigned milliseconds_up(Seconds time) {
  return static_cast<unsigned>(std::ceil(std::clamp(in_milliseconds(time), 0.0, 1e6)));
}

class SerialPort final : public Wire {
 public:
  SerialPort(PortHandle port, int fd, std::string address)
      : port_(std::move(port)), fd_(fd), address_(std::move(address)) {}
  SerialPort(const SerialPort&) = delete;
  SerialPort& operator=(const SerialPort&) = delete;
  ~SerialPort() override {
    // Otherwise the kernel waits up to 30 s for a device that accepts no more bytes.
    ::tcflush(fd_, TCIOFLUSH);
    sp_close(port_.get());
  }

  Status write(std::string_view bytes, Seconds deadline) override {
    // In libserialport, 0 ms means no timeout.
    const unsigned ms = std::max(milliseconds_up(deadline), 1U);
    const int written = sp_blocking_write(port_.get(), bytes.data(), bytes.size(), ms);
    if (written < 0) return lost();
    if (static_cast<std::size_t>(written) == bytes.size()) return {};
    return Error{ErrorKind::timed_out,
                 fmt::format("{} took no bytes for {} ms", address_, ms),
                 {},
                 "check that it is switched on, and the cable"};
  }

  Result<std::string> read(Seconds deadline) override {
    pollfd ready{fd_, POLLIN, 0};
    const int found = ::poll(&ready, 1, static_cast<int>(milliseconds_up(deadline)));
    if (found < 0 && errno != EINTR) return lost();
    if (found <= 0) return Error{ErrorKind::timed_out, fmt::format("nothing came from {}", address_)};
    // After unplugging, remaining input is of no use.
    if ((ready.revents & (POLLHUP | POLLERR | POLLNVAL)) != 0) return lost();
    char bytes[512];
    const int count = sp_nonblocking_read(port_.get(), bytes, sizeof bytes);
    if (count <= 0) return lost();
    return std::string(bytes, static_cast<std::size_t>(count));
  }

 private:
  [[nodiscard]] Error lost() const {
    return {ErrorKind::device,
            fmt::format("{} is gone", address_),
            {},
            "plug it in again: it is found by itself"};
  }

  PortHandle port_;
  int fd_;  // the port's descriptor
  std::string address_;
};

struct FreeConfig {
  void operator()(sp_port_config* config) const { sp_free_config(config); }
};

/// One call for all settings, since each call queries the USB device and may block in the kernel.
sp_return configure(sp_port* port, int baud) {
  sp_port_config* made = nullptr;
  if (const sp_return status = sp_new_config(&made); status != SP_OK) return status;
  const std::unique_ptr<sp_port_config, FreeConfig> config(made);
  sp_set_config_baudrate(made, baud);
  sp_set_config_bits(made, 8);
  sp_set_config_parity(made, SP_PARITY_NONE);
  sp_set_config_stopbits(made, 1);
  sp_set_config_flowcontrol(made, SP_FLOWCONTROL_NONE);
  return sp_set_config(port, made);
}

}  // namespace

Result<std::vector<Port>> list_ports() {
  sp_port** list = nullptr;
  if (sp_list_ports(&list) != SP_OK)
    return Error{ErrorKind::io, "can't list the serial ports: " + last_error(), "strobe",
                 "check /sys/class/tty"};
  const std::unique_ptr<sp_port*, void (*)(sp_port**)> owned(list, sp_free_port_list);
  std::vector<Port> ports;
  for (sp_port** at = list; *at != nullptr; ++at) {
    const std::string address = text(sp_get_port_name(*at));
    const std::string name = std::filesystem::path(address).filename();
    Port port{address, text(sp_get_port_usb_serial(*at)), usb_place(name),
              text(sp_get_port_description(*at))};
    if (sp_get_port_transport(*at) == SP_TRANSPORT_USB) {
      const std::string maker = text(sp_get_port_usb_manufacturer(*at)),
                        model = text(sp_get_port_usb_product(*at));
      if (!model.empty()) port.description = maker.empty() ? model : fmt::format("{} {}", maker, model);
      if (port.place.empty()) continue;  // unplugged meanwhile
    } else if (port.place.empty()) {
      port.place = name;
    }
    ports.push_back(std::move(port));
  }
  return ports;
}

std::string id_of(const Port& port, const std::vector<Port>& all) {
  const auto alike =
      std::count_if(all.begin(), all.end(), [&](const Port& p) { return p.serial == port.serial; });
  return port.serial.empty() || alike > 1 ? port.place : port.serial;
}

Result<Port> find_port(const std::string& id) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<Port> ports, list_ports());
  std::vector<Port> found;
  std::string places;
  for (const Port& port : ports) {
    if (port.place == id) return port;
    if (port.serial != id || id.empty()) continue;
    found.push_back(port);
    places += " " + port.place;
  }
  if (found.size() == 1) return found.front();
  if (found.empty())
    return Error{
        ErrorKind::device, "it isn't plugged in", {}, "plug it in; emberlock devices lists what there is"};
  return Error{ErrorKind::device, "several have this serial number", {}, "name it by its place:" + places};
}

Result<std::unique_ptr<Wire>> open_port(const Port& port, int baud) {
  if (holder_of(port.address)) return held_error(port.address, {});
  sp_port* made = nullptr;
  if (sp_get_port_by_name(port.address.c_str(), &made) != SP_OK)
    return Error{ErrorKind::device, port.address + " is gone", {}, "plug it in again: it is found by itself"};
  PortHandle handle(made);
  const auto refuse = [&](const char* what) {
    return Error{ErrorKind::device,
                 fmt::format("can't {} {}: {}", what, port.address, last_error()),
                 {},
                 "be a member of the group that udev/README.md names"};
  };
  if (sp_open(made, SP_MODE_READ_WRITE) != SP_OK) {
    if (sp_last_error_code() == EBUSY) return held_error(port.address, {});
    return refuse("open");
  }
  int fd = -1;
  sp_get_port_handle(made, &fd);
  auto wire = std::make_unique<SerialPort>(std::move(handle), fd, port.address);
  if (configure(made, baud) != SP_OK) return refuse("set up");
  termios settings{};
  if (::ioctl(fd, TIOCEXCL) != 0 || ::tcgetattr(fd, &settings) != 0) return refuse("set up");
  settings.c_cflag &= ~static_cast<tcflag_t>(HUPCL);
  if (::tcsetattr(fd, TCSANOW, &settings) != 0 || ::tcflush(fd, TCIOFLUSH) != 0) return refuse("set up");
  return std::unique_ptr<Wire>(std::move(wire));
}

}  // namespace emberlock::drivers::strobe_serial
