// SPDX-License-Identifier: Apache-2.0
#include "tests/support/chdk_responder/usbredir_line.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <string>
#include <utility>

#include <unistd.h>

namespace emberlock::chdk_responder {
namespace {

constexpr std::uint8_t kIn = 0x81, kOut = 0x02, kEvents = 0x83;
constexpr std::uint8_t kClassRequest = 0x20, kToDevice = 0x80;

UsbredirLine& line_of(void* self) { return *static_cast<UsbredirLine*>(self); }

std::uint8_t low(std::uint16_t v) { return static_cast<std::uint8_t>(v); }
std::uint8_t high(std::uint16_t v) { return static_cast<std::uint8_t>(v >> 8); }

std::vector<std::uint8_t> device_descriptor(std::uint16_t vendor) {
  return {18, 1, 0x00, 0x02, 0, 0, 0, 64, low(vendor), high(vendor), 0x01, 0x32, 0x00, 0x01, 1, 2, 3, 1};
}

std::vector<std::uint8_t> configuration_descriptor(std::uint16_t packet) {
  return {9, 2,    39,      0, 1,           1,
          0, 0xc0, 1,  // itself, 39 bytes, one interface
          9, 4,    0,       0, 3,           6,
          1, 1,    0,  // still image, PIMA 15740
          7, 5,    kIn,     2, low(packet), high(packet),
          0,  //
          7, 5,    kOut,    2, low(packet), high(packet),
          0,  //
          7, 5,    kEvents, 3, 64,          0,
          9};
}

std::vector<std::uint8_t> string_descriptor(const std::string& text) {
  std::vector<std::uint8_t> bytes{static_cast<std::uint8_t>(2 + 2 * text.size()), 3};
  for (const char c : text) {
    bytes.push_back(static_cast<std::uint8_t>(c));
    bytes.push_back(0);
  }
  return bytes;
}

/// usbredir's number of an endpoint in its tables of 32.
std::size_t slot(std::uint8_t endpoint) { return (endpoint & 0x0fu) | ((endpoint & 0x80u) != 0 ? 16u : 0u); }

}  // namespace

UsbredirLine::UsbredirLine(UniqueFd socket, Device& device, Clock& clock)
    : socket_(std::move(socket)), device_(device), clock_(clock), parser_(usbredirparser_create()) {
  set_callbacks();
  std::uint32_t caps[USB_REDIR_CAPS_SIZE] = {};
  for (const int cap : {usb_redir_cap_connect_device_version, usb_redir_cap_ep_info_max_packet_size,
                        usb_redir_cap_64bits_ids, usb_redir_cap_32bits_bulk_length}) {
    usbredirparser_caps_set_cap(caps, cap);
  }
  usbredirparser_init(parser_.get(), "emberlock chdk_responder", caps, USB_REDIR_CAPS_SIZE,
                      usbredirparser_fl_usb_host);
}

void UsbredirLine::set_callbacks() {
  usbredirparser& p = *parser_;
  p.priv = this;
  p.log_func = [](void*, int level, const char* text) {
    if (level <= usbredirparser_warning) std::fprintf(stderr, "chdk_responder: %s\n", text);
  };
  p.read_func = [](void* self, std::uint8_t* data, int count) {
    UsbredirLine& line = line_of(self);
    const ssize_t n = ::read(line.socket(), data, static_cast<std::size_t>(count));
    if (n > 0) return static_cast<int>(n);
    if (n < 0 && (errno == EAGAIN || errno == EINTR)) return 0;
    line.gone_ = true;
    return -1;
  };
  p.write_func = [](void* self, std::uint8_t* data, int count) {
    const ssize_t n = ::write(line_of(self).socket(), data, static_cast<std::size_t>(count));
    if (n >= 0) return static_cast<int>(n);
    return errno == EAGAIN || errno == EINTR ? 0 : -1;
  };
  p.hello_func = [](void* self, usb_redir_hello_header*) { line_of(self).plug(); };
  p.reset_func = [](void* self) {
    line_of(self).device_.reset();
    line_of(self).halted_ = false;
  };
  p.set_configuration_func = [](void* self, std::uint64_t id, usb_redir_set_configuration_header* h) {
    usb_redir_configuration_status_header status{usb_redir_success, h->configuration};
    usbredirparser_send_configuration_status(line_of(self).parser_.get(), id, &status);
  };
  p.get_configuration_func = [](void* self, std::uint64_t id) {
    usb_redir_configuration_status_header status{usb_redir_success, 1};
    usbredirparser_send_configuration_status(line_of(self).parser_.get(), id, &status);
  };
  p.set_alt_setting_func = [](void* self, std::uint64_t id, usb_redir_set_alt_setting_header* h) {
    usb_redir_alt_setting_status_header status{usb_redir_success, h->interface, h->alt};
    usbredirparser_send_alt_setting_status(line_of(self).parser_.get(), id, &status);
  };
  p.get_alt_setting_func = [](void* self, std::uint64_t id, usb_redir_get_alt_setting_header* h) {
    usb_redir_alt_setting_status_header status{usb_redir_success, h->interface, 0};
    usbredirparser_send_alt_setting_status(line_of(self).parser_.get(), id, &status);
  };
  p.start_interrupt_receiving_func = [](void* self, std::uint64_t id,
                                        usb_redir_start_interrupt_receiving_header* h) {
    usb_redir_interrupt_receiving_status_header status{usb_redir_success, h->endpoint};
    usbredirparser_send_interrupt_receiving_status(line_of(self).parser_.get(), id, &status);
  };
  p.stop_interrupt_receiving_func = [](void* self, std::uint64_t id,
                                       usb_redir_stop_interrupt_receiving_header* h) {
    usb_redir_interrupt_receiving_status_header status{usb_redir_success, h->endpoint};
    usbredirparser_send_interrupt_receiving_status(line_of(self).parser_.get(), id, &status);
  };
  p.control_packet_func = [](void* self, std::uint64_t id, usb_redir_control_packet_header* h,
                             std::uint8_t* data, int) {
    usbredirparser_free_packet_data(line_of(self).parser_.get(), data);
    line_of(self).answer_control(id, *h);
  };
  p.bulk_packet_func = [](void* self, std::uint64_t id, usb_redir_bulk_packet_header* h, std::uint8_t* data,
                          int length) {
    line_of(self).answer_bulk(id, *h, std::as_bytes(std::span(data, static_cast<std::size_t>(length))));
    usbredirparser_free_packet_data(line_of(self).parser_.get(), data);
  };
  p.cancel_data_packet_func = [](void* self, std::uint64_t id) { line_of(self).cancel(id); };
  p.filter_reject_func = [](void*) {};
  p.filter_filter_func = [](void*, usbredirfilter_rule* rules, int) { std::free(rules); };
  p.device_disconnect_ack_func = [](void*) {};
}

void UsbredirLine::plug() {
  const auto packet = static_cast<std::uint16_t>(device_.options().packet_bytes);
  usb_redir_interface_info_header interfaces{};
  interfaces.interface_count = 1;
  interfaces.interface_class[0] = 6;
  interfaces.interface_subclass[0] = 1;
  interfaces.interface_protocol[0] = 1;
  usbredirparser_send_interface_info(parser_.get(), &interfaces);

  usb_redir_ep_info_header endpoints{};
  std::fill(std::begin(endpoints.type), std::end(endpoints.type), std::uint8_t{usb_redir_type_invalid});
  const auto describe = [&](std::uint8_t endpoint, std::uint8_t type, std::uint16_t size) {
    endpoints.type[slot(endpoint)] = type;
    endpoints.max_packet_size[slot(endpoint)] = size;
  };
  describe(0x00, usb_redir_type_control, 64);
  describe(0x80, usb_redir_type_control, 64);
  describe(kIn, usb_redir_type_bulk, packet);
  describe(kOut, usb_redir_type_bulk, packet);
  describe(kEvents, usb_redir_type_interrupt, 64);
  endpoints.interval[slot(kEvents)] = 9;
  usbredirparser_send_ep_info(parser_.get(), &endpoints);

  usb_redir_device_connect_header device{};
  device.speed = usb_redir_speed_high;
  device.vendor_id = device_.options().usb_vendor;
  device.product_id = 0x3201;
  device.device_version_bcd = 0x0100;
  usbredirparser_send_device_connect(parser_.get(), &device);
}

void UsbredirLine::unplug() {
  waiting_.clear();
  halted_ = false;
  usbredirparser_send_device_disconnect(parser_.get());
}

std::vector<std::uint8_t> UsbredirLine::control(const usb_redir_control_packet_header& h, int& status) {
  const bool of_class = (h.requesttype & 0x60) == kClassRequest;
  const bool of_endpoint = (h.requesttype & 0x1f) == 2;
  if (of_class && h.request == 0x66) {
    device_.reset();
    halted_ = false;
    return {};
  }
  if (of_class && h.request == 0x64) {
    device_.cancel();
    return {};
  }
  if (of_class && h.request == 0x67) return {4, 0, 0x01, 0x20};
  if (!of_class && h.request == 0x00) {
    return {static_cast<std::uint8_t>(of_endpoint && h.index == kIn && halted_ ? 1 : 0), 0};
  }
  if (!of_class && h.request == 0x01) {
    if (of_endpoint && h.index == kIn) halted_ = false;
    return {};
  }
  if (!of_class && h.request == 0x06) {
    const DeviceOptions& o = device_.options();
    switch (h.value) {
      case 0x0100:
        return device_descriptor(o.usb_vendor);
      case 0x0200:
        return configuration_descriptor(static_cast<std::uint16_t>(o.packet_bytes));
      case 0x0300:
        return {4, 3, 0x09, 0x04};
      case 0x0301:
        return string_descriptor("Canon Inc.");
      case 0x0302:
        return string_descriptor(o.model);
      case 0x0303:
        return string_descriptor(o.serial);
      default:
        break;
    }
  }
  status = usb_redir_stall;
  return {};
}

void UsbredirLine::answer_control(std::uint64_t id, usb_redir_control_packet_header header) {
  int status = usb_redir_success;
  std::vector<std::uint8_t> data = control(header, status);
  const bool to_host = (header.requesttype & kToDevice) != 0;
  if (to_host) data.resize(std::min<std::size_t>(data.size(), header.length));
  header.status = static_cast<std::uint8_t>(status);
  if (to_host || status != usb_redir_success) header.length = static_cast<std::uint16_t>(data.size());
  usbredirparser_send_control_packet(parser_.get(), id, &header, data.empty() ? nullptr : data.data(),
                                     static_cast<int>(data.size()));
}

void UsbredirLine::answer_bulk(std::uint64_t id, usb_redir_bulk_packet_header header,
                               std::span<const std::byte> data) {
  if (header.endpoint == kIn) {
    waiting_.push_back({id, header});
    answer_waiting();
    return;
  }
  device_.receive(data, clock_.now());
  header.status = usb_redir_success;
  usbredirparser_send_bulk_packet(parser_.get(), id, &header, nullptr, 0);
}

void UsbredirLine::reply_bulk(const Waiting& to, int status, std::span<const std::byte> data) {
  usb_redir_bulk_packet_header header = to.header;
  header.status = static_cast<std::uint8_t>(status);
  header.length = static_cast<std::uint16_t>(data.size());
  header.length_high = static_cast<std::uint16_t>(data.size() >> 16);
  // The parser copies what it is given.
  auto* bytes = const_cast<std::uint8_t*>(reinterpret_cast<const std::uint8_t*>(data.data()));
  usbredirparser_send_bulk_packet(parser_.get(), to.id, &header, data.empty() ? nullptr : bytes,
                                  static_cast<int>(data.size()));
}

void UsbredirLine::cancel(std::uint64_t id) {
  const auto found =
      std::find_if(waiting_.begin(), waiting_.end(), [id](const Waiting& w) { return w.id == id; });
  if (found == waiting_.end()) return;  // it was answered already
  reply_bulk(*found, usb_redir_cancelled, {});
  waiting_.erase(found);
}

std::optional<TimePoint> UsbredirLine::next_answer() const {
  return waiting_.empty() ? std::nullopt : device_.next_ready();
}

void UsbredirLine::answer_waiting() {
  while (!waiting_.empty()) {
    const Waiting& first = waiting_.front();
    const std::size_t most = first.header.length | static_cast<std::size_t>(first.header.length_high) << 16;
    if (!halted_) {
      const auto piece = device_.take(most, clock_.now());
      if (!piece) return;
      halted_ = piece->stalls;
      if (!halted_) reply_bulk(first, usb_redir_success, piece->bytes);
    }
    if (halted_) reply_bulk(first, usb_redir_stall, {});
    waiting_.pop_front();
  }
}

bool UsbredirLine::serve() {
  usbredirparser_do_read(parser_.get());
  answer_waiting();
  if (!gone_ && wants_to_write() && usbredirparser_do_write(parser_.get()) != 0) gone_ = true;
  return !gone_;
}

}  // namespace emberlock::chdk_responder
