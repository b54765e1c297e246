// SPDX-License-Identifier: Apache-2.0
#include "drivers/ptp/usb_transport.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <span>
#include <utility>

#include <fmt/format.h>
#include <libusb.h>

#include "base/clock.h"
#include "base/log.h"
#include "drivers/holder.h"

namespace emberlock::drivers {
namespace {

constexpr std::uint16_t kCanon = 0x04a9;
constexpr Seconds kControlDeadline = milliseconds(150);
constexpr Seconds kCancelDeadline = milliseconds(500);
constexpr Seconds kDrainPause = milliseconds(20);
/// How long a recovery may drain the pipes; the steps before it take at most 1.1 s.
constexpr Seconds kRecovery = milliseconds(1500);
constexpr std::size_t kBuffer = std::size_t{1} << 18;

// Class-specific requests of the still image class (PIMA 15740:2000, annex D.5.2).
enum ClassRequest : std::uint8_t { kCancel = 0x64, kDeviceReset = 0x66, kGetDeviceStatus = 0x67 };
constexpr std::uint8_t kToInterface = 0x21, kFromInterface = 0xa1, kFromEndpoint = 0x82;
constexpr std::uint16_t kCancellationCode = 0x4001;
constexpr std::uint16_t kStatusOk = 0x2001;

unsigned as_milliseconds(Seconds t) {
  return static_cast<unsigned>(std::max(1.0, std::ceil(in_milliseconds(t))));  // 0 means no timeout
}

timeval as_timeval(Seconds t) {
  const auto us = static_cast<std::int64_t>(std::max(0.0, in_microseconds(t)));
  return {static_cast<time_t>(us / 1'000'000), static_cast<suseconds_t>(us % 1'000'000)};
}

struct Release {
  void operator()(libusb_context* context) const { libusb_exit(context); }
  void operator()(libusb_device_handle* handle) const { libusb_close(handle); }
  void operator()(libusb_config_descriptor* config) const { libusb_free_config_descriptor(config); }
  void operator()(libusb_transfer* transfer) const { libusb_free_transfer(transfer); }
};
using Context = std::unique_ptr<libusb_context, Release>;
using Handle = std::unique_ptr<libusb_device_handle, Release>;
using Config = std::unique_ptr<libusb_config_descriptor, Release>;
using Transfer = std::unique_ptr<libusb_transfer, Release>;

/// The bus at this moment. A new context for each use, because an older one sees changes only where udev
/// runs.
struct Bus {
  Context context;
  std::vector<libusb_device*> devices;

  static Result<Bus> scan() {
    libusb_context* context = nullptr;
    int error = libusb_init(&context);
    if (error != 0) return unusable(error);
    Bus bus;
    bus.context.reset(context);
    libusb_device** list = nullptr;
    const ssize_t count = libusb_get_device_list(context, &list);
    if (count < 0) return unusable(static_cast<int>(count));
    bus.devices.assign(list, list + count);
    libusb_free_device_list(list, 0);
    return bus;
  }
  Bus() = default;
  Bus(Bus&&) = default;
  Bus& operator=(Bus&&) = delete;
  ~Bus() {
    for (libusb_device* device : devices) libusb_unref_device(device);
  }

 private:
  static Error unusable(int error) {
    return {ErrorKind::io, fmt::format("USB can't be used: {}", libusb_strerror(error)), "USB",
            "see whether /dev/bus/usb is there and may be read"};
  }
};

struct PtpInterface {
  int number = 0;
  std::uint8_t in = 0;
  std::uint8_t out = 0;
  std::size_t packet_bytes = 0;
};

std::optional<PtpInterface> ptp_interface(const libusb_interface_descriptor& d, std::uint16_t vendor) {
  const bool still_image =
      d.bInterfaceClass == LIBUSB_CLASS_IMAGE && d.bInterfaceSubClass == 1 && d.bInterfaceProtocol == 1;
  if (!still_image && !(vendor == kCanon && d.bInterfaceClass == LIBUSB_CLASS_VENDOR_SPEC)) return {};
  PtpInterface found{.number = d.bInterfaceNumber};
  for (const libusb_endpoint_descriptor& e : std::span(d.endpoint, d.bNumEndpoints)) {
    if ((e.bmAttributes & 3) != LIBUSB_TRANSFER_TYPE_BULK) continue;
    const bool in = (e.bEndpointAddress & LIBUSB_ENDPOINT_IN) != 0;
    (in ? found.in : found.out) = e.bEndpointAddress;
    if (in) found.packet_bytes = e.wMaxPacketSize;
  }
  if (found.in == 0 || found.out == 0 || found.packet_bytes == 0) return {};
  return found;
}

std::optional<PtpInterface> ptp_interface(libusb_device* device, std::uint16_t vendor) {
  libusb_config_descriptor* raw = nullptr;
  if (libusb_get_active_config_descriptor(device, &raw) != 0) return {};
  const Config config(raw);
  for (const libusb_interface& interface : std::span(config->interface, config->bNumInterfaces)) {
    if (interface.num_altsetting < 1) continue;
    if (const auto found = ptp_interface(interface.altsetting[0], vendor)) return found;
  }
  return {};
}

std::string read_line(const std::filesystem::path& file) {
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  return line;
}

/// The controller of a bus. Bus numbers aren't stable, because they depend on the order of discovery.
std::string controller_of(const std::filesystem::path& sysfs, int bus) {
  std::error_code error;
  const std::filesystem::path root = "usb" + std::to_string(bus);
  std::filesystem::path at = std::filesystem::canonical(sysfs, error);
  while (!error && at.has_relative_path() && at.filename() != root) at = at.parent_path();
  return at.filename() == root ? at.parent_path().filename().string() : std::to_string(bus);
}

UsbPtpDevice describe(libusb_device* device, std::uint16_t vendor) {
  UsbPtpDevice found;
  found.vendor = vendor;
  found.bus = libusb_get_bus_number(device);
  found.number = libusb_get_device_address(device);
  std::array<std::uint8_t, 8> ports{};
  const int depth = libusb_get_port_numbers(device, ports.data(), static_cast<int>(ports.size()));
  std::string plug;
  for (int i = 0; i < depth; ++i)
    plug += (i == 0 ? '-' : '.') + std::to_string(ports.at(static_cast<std::size_t>(i)));
  // From sysfs, where the kernel keeps the descriptor, so that a hanging device isn't queried.
  const std::filesystem::path sysfs = "/sys/bus/usb/devices/" + std::to_string(found.bus) + plug;
  found.path = "usb-" + controller_of(sysfs, found.bus) + plug;
  found.name = read_line(sysfs / "product");
  found.serial = read_line(sysfs / "serial");
  found.megabits = std::atof(read_line(sysfs / "speed").c_str());
  return found;
}

class UsbTransport final : public PtpTransport {
 public:
  UsbTransport(Context context, Handle handle, PtpInterface interface)
      : context_(std::move(context)),
        handle_(std::move(handle)),
        interface_(interface),
        transfer_(libusb_alloc_transfer(0)),
        buffer_(std::make_unique<std::byte[]>(kBuffer)) {}
  ~UsbTransport() override;
  UsbTransport(const UsbTransport&) = delete;
  UsbTransport& operator=(const UsbTransport&) = delete;

  [[nodiscard]] std::size_t packet_bytes() const override { return interface_.packet_bytes; }
  Status send(std::span<const std::byte> transfer, Seconds deadline) override;
  Result<PtpPiece> receive(std::size_t most, Seconds deadline) override;
  Status recover(std::uint32_t transaction) override;

 private:
  enum class Fly { landed, flying };

  static Error failed(int error);
  Status write(std::span<const std::byte> bytes, Seconds deadline);
  void wait_for_landing(Seconds deadline);
  Fly cancel_receiving();
  /// Sends a class request to the interface. Returns the number of bytes transferred, or libusb's error.
  int ask(ClassRequest request, std::uint8_t direction, std::span<std::uint8_t> data);
  /// Cancels a transaction. Returns whether the device accepts that and is ready again.
  bool cancel(std::uint32_t transaction);
  int clear_halt(std::uint8_t endpoint);
  int drain(TimePoint until);

  Context context_;
  Handle handle_;
  PtpInterface interface_;
  Transfer transfer_;
  std::unique_ptr<std::byte[]> buffer_;  ///< of kBuffer bytes
  int flying_most_ = 0;                  ///< size of the pending receive transfer; 0 if there is none
  int landed_ = 0;                       ///< set by libusb when the transfer ends
  SteadyClock clock_;
};

Error UsbTransport::failed(int error) {
  if (error == LIBUSB_ERROR_NO_DEVICE) {
    return {ErrorKind::device, "it was unplugged or switched off", {}, "plug it in and switch it on"};
  }
  if (error == LIBUSB_ERROR_PIPE) return {ErrorKind::device, "it stalls its pipe", {}, {}};
  const auto kind = error == LIBUSB_ERROR_TIMEOUT ? ErrorKind::timed_out : ErrorKind::device;
  return {kind, fmt::format("its USB connection fails: {}", libusb_strerror(error)), {}, "see to its cable"};
}

Status UsbTransport::write(std::span<const std::byte> bytes, Seconds deadline) {
  // libusb doesn't write to outgoing data.
  auto* data = const_cast<unsigned char*>(reinterpret_cast<const unsigned char*>(bytes.data()));
  int sent = 0;
  const int error = libusb_bulk_transfer(handle_.get(), interface_.out, data, static_cast<int>(bytes.size()),
                                         &sent, as_milliseconds(deadline));
  return error == 0 ? Status() : failed(error);
}

Status UsbTransport::send(std::span<const std::byte> transfer, Seconds deadline) {
  EMBERLOCK_RETURN_IF_ERROR(write(transfer, deadline));
  return transfer.size() % interface_.packet_bytes == 0 ? write({}, deadline) : Status();
}

void UsbTransport::wait_for_landing(Seconds deadline) {
  const TimePoint until = clock_.now() + deadline;
  do {
    timeval left = as_timeval(until - clock_.now());
    libusb_handle_events_timeout_completed(context_.get(), &left, &landed_);
  } while (landed_ == 0 && clock_.now() < until);
}

Result<PtpPiece> UsbTransport::receive(std::size_t most, Seconds deadline) {
  // A pending transfer continues when the caller stops waiting, because cancelling it could lose received
  // data.
  if (flying_most_ == 0) {
    const int size = static_cast<int>(std::min(most, kBuffer));
    landed_ = 0;
    libusb_fill_bulk_transfer(
        transfer_.get(), handle_.get(), interface_.in, reinterpret_cast<unsigned char*>(buffer_.get()), size,
        [](libusb_transfer* t) { *static_cast<int*>(t->user_data) = 1; }, &landed_, 0);
    const int error = libusb_submit_transfer(transfer_.get());
    if (error != 0) return failed(error);
    flying_most_ = size;
  }
  wait_for_landing(deadline);
  if (landed_ == 0) return Error{ErrorKind::timed_out, "it sends nothing"};
  const int asked = std::exchange(flying_most_, 0);
  switch (transfer_->status) {
    case LIBUSB_TRANSFER_COMPLETED:
      return PtpPiece{{buffer_.get(), static_cast<std::size_t>(transfer_->actual_length)},
                      transfer_->actual_length < asked ? PtpPieceEnd::short_packet : PtpPieceEnd::more};
    case LIBUSB_TRANSFER_NO_DEVICE:
      return failed(LIBUSB_ERROR_NO_DEVICE);
    case LIBUSB_TRANSFER_STALL:
      return failed(LIBUSB_ERROR_PIPE);
    case LIBUSB_TRANSFER_OVERFLOW:
      return failed(LIBUSB_ERROR_OVERFLOW);
    default:
      return failed(LIBUSB_ERROR_IO);
  }
}

UsbTransport::Fly UsbTransport::cancel_receiving() {
  if (flying_most_ == 0) return Fly::landed;
  libusb_cancel_transfer(transfer_.get());
  wait_for_landing(kCancelDeadline);
  if (landed_ == 0) return Fly::flying;
  flying_most_ = 0;
  return Fly::landed;
}

int UsbTransport::ask(ClassRequest request, std::uint8_t direction, std::span<std::uint8_t> data) {
  return libusb_control_transfer(handle_.get(), direction, request, 0,
                                 static_cast<std::uint16_t>(interface_.number), data.data(),
                                 static_cast<std::uint16_t>(data.size()), as_milliseconds(kControlDeadline));
}

bool UsbTransport::cancel(std::uint32_t transaction) {
  std::array<std::uint8_t, 6> order{kCancellationCode & 0xff, kCancellationCode >> 8};
  for (std::size_t i = 0; i < 4; ++i) order.at(2 + i) = static_cast<std::uint8_t>(transaction >> (8 * i));
  if (ask(kCancel, kToInterface, order) < 0) return false;
  const TimePoint until = clock_.now() + kControlDeadline;
  while (clock_.now() < until) {
    std::array<std::uint8_t, 20> status{};
    if (ask(kGetDeviceStatus, kFromInterface, status) < 4) return false;
    if ((status[2] | status[3] << 8) == kStatusOk) return true;
    clock_.sleep_until(clock_.now() + kDrainPause);
  }
  return false;
}

int UsbTransport::clear_halt(std::uint8_t endpoint) {
  // Only halted pipes are cleared: otherwise some devices lose their packet toggle.
  std::array<std::uint8_t, 2> status{1, 0};
  const int error = libusb_control_transfer(
      handle_.get(), kFromEndpoint, LIBUSB_REQUEST_GET_STATUS, 0, endpoint, status.data(),
      static_cast<std::uint16_t>(status.size()), as_milliseconds(kControlDeadline));
  if (error == LIBUSB_ERROR_TIMEOUT || error == LIBUSB_ERROR_NO_DEVICE) return error;
  return (status[0] & 1) != 0 ? libusb_clear_halt(handle_.get(), endpoint) : 0;
}

int UsbTransport::drain(TimePoint until) {
  while (clock_.now() < until) {
    int came = 0;
    const int error =
        libusb_bulk_transfer(handle_.get(), interface_.in, reinterpret_cast<unsigned char*>(buffer_.get()),
                             static_cast<int>(kBuffer), &came, as_milliseconds(kDrainPause));
    if (error == LIBUSB_ERROR_TIMEOUT && came == 0) return 0;
    if (error != 0 && error != LIBUSB_ERROR_TIMEOUT) return error;
  }
  return LIBUSB_ERROR_OTHER;
}

Status UsbTransport::recover(std::uint32_t transaction) {
  log(LogCategory::drivers).debug("ptp: recovers from transaction {}", transaction);
  const TimePoint until = clock_.now() + kRecovery;
  if (cancel_receiving() == Fly::flying) return failed(LIBUSB_ERROR_BUSY);
  if (!cancel(transaction)) {
    const int error = ask(kDeviceReset, kToInterface, {});
    if (error == LIBUSB_ERROR_NO_DEVICE) return failed(error);
    if (error == LIBUSB_ERROR_TIMEOUT) return failed(error);  // it doesn't even answer on the control pipe
  }
  for (const std::uint8_t endpoint : {interface_.in, interface_.out}) {
    const int error = clear_halt(endpoint);
    if (error != 0) return failed(error);
  }
  const int error = drain(until);
  return error == 0 ? Status() : failed(error);
}

Error unopened(const UsbPtpDevice& device, int error) {
  return {ErrorKind::device, fmt::format("it can't be opened: {}", libusb_strerror(error)), device.path,
          "unplug it and plug it in again"};
}

UsbTransport::~UsbTransport() {
  if (cancel_receiving() == Fly::flying) {
    // The kernel may still write to this memory, so it is leaked rather than freed.
    log(LogCategory::drivers).error("ptp: a transfer can't be cancelled, its memory is left behind");
    (void)transfer_.release();
    (void)buffer_.release();
    (void)handle_.release();
    (void)context_.release();
    return;
  }
  libusb_release_interface(handle_.get(), interface_.number);
}

}  // namespace

std::filesystem::path UsbPtpDevice::node() const {
  return fmt::format("/dev/bus/usb/{:03}/{:03}", bus, number);
}

Result<std::vector<UsbPtpDevice>> list_usb_ptp() {
  EMBERLOCK_ASSIGN_OR_RETURN(const Bus bus, Bus::scan());
  std::vector<UsbPtpDevice> found;
  for (libusb_device* device : bus.devices) {
    libusb_device_descriptor descriptor{};
    if (libusb_get_device_descriptor(device, &descriptor) != 0) continue;
    if (ptp_interface(device, descriptor.idVendor)) found.push_back(describe(device, descriptor.idVendor));
  }
  std::sort(found.begin(), found.end(),
            [](const UsbPtpDevice& a, const UsbPtpDevice& b) { return a.path < b.path; });
  return found;
}

Result<std::unique_ptr<PtpTransport>> open_usb_ptp(const UsbPtpDevice& device) {
  EMBERLOCK_ASSIGN_OR_RETURN(Bus bus, Bus::scan());
  for (libusb_device* candidate : bus.devices) {
    if (libusb_get_bus_number(candidate) != device.bus ||
        libusb_get_device_address(candidate) != device.number) {
      continue;
    }
    const auto interface = ptp_interface(candidate, device.vendor);
    if (!interface) break;
    libusb_device_handle* raw = nullptr;
    int error = libusb_open(candidate, &raw);
    if (error == LIBUSB_ERROR_ACCESS) {
      return Error{ErrorKind::device, "we may not open " + device.node().string(), device.path,
                   "install the udev rules and join their group (udev/README.md)"};
    }
    if (error != 0) return unopened(device, error);
    Handle handle(raw);
    error = libusb_claim_interface(raw, interface->number);
    if (error == LIBUSB_ERROR_BUSY) return held_error(device.node(), device.path);
    if (error != 0) return unopened(device, error);
    return std::unique_ptr<PtpTransport>(
        std::make_unique<UsbTransport>(std::move(bus.context), std::move(handle), *interface));
  }
  return Error{ErrorKind::device, "it isn't there any more", device.path, "plug it in and switch it on"};
}

}  // namespace emberlock::drivers
