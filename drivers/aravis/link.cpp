// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/link.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <system_error>
#include <thread>
#include <utility>

#include <netinet/in.h>
#include <sys/socket.h>

#include "base/clock.h"
#include "base/log.h"
#include "drivers/aravis/pixel_format.h"

namespace emberlock::drivers::aravis {
namespace {

constexpr std::uint64_t kNoId =
    ~std::uint64_t{0};  // not the id of any frame: GigE uses 16 bits, USB3 starts low

/// The memory of a buffer that becomes an image.
struct ImageMemory {
  std::shared_ptr<Image> image;
};
void free_memory(gpointer memory) { delete static_cast<ImageMemory*>(memory); }

using Flag = std::shared_ptr<std::atomic<bool>>;
void on_control_lost(ArvDevice* device, gpointer flag) {
  **static_cast<Flag*>(flag) = true;
  // The thread that calls us (the heartbeat's) holds a reference to the device. If it were the last one, the
  // device would be destroyed on that thread and wait for it forever. So another reference is held until all
  // others are gone.
  std::thread([device = ObjectPtr<ArvDevice>(ARV_DEVICE(g_object_ref(device)))] {
    while (g_atomic_int_get(&G_OBJECT(device.get())->ref_count) > 1) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }).detach();
}
void free_flag(gpointer flag, GClosure*) { delete static_cast<Flag*>(flag); }

/// Sets the receive buffer of this process's UDP socket bound to `port`.
void enlarge_socket(std::uint16_t port, int bytes) {
  std::error_code gone;
  for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd", gone)) {
    const int fd = std::atoi(entry.path().filename().c_str());
    sockaddr_in bound{};
    socklen_t size = sizeof bound;
    int type = 0;
    socklen_t type_size = sizeof type;
    if (::getsockname(fd, reinterpret_cast<sockaddr*>(&bound), &size) != 0 || bound.sin_family != AF_INET ||
        ntohs(bound.sin_port) != port || ::getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &type_size) != 0 ||
        type != SOCK_DGRAM) {
      continue;
    }
    ::setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
  }
}

}  // namespace

Result<std::shared_ptr<Link>> Link::open(const DiscoveredCamera& seen, const CameraRequest& request) {
  const std::string where = "camera " + seen.id;
  std::shared_ptr<Link> link(new Link);
  EMBERLOCK_ASSIGN_OR_RETURN(link->camera_, open_discovered(seen));
  link->where_ = where;
  link->discovered_ = seen;
  ArvCamera* camera = link->camera_.get();
  ArvDevice* device = arv_camera_get_device(camera);
  g_signal_connect_data(device, "control-lost", G_CALLBACK(on_control_lost), new Flag(link->control_lost_),
                        free_flag, GConnectFlags{});
  ErrorSlot error;
  if (arv_camera_is_gv_device(camera) != 0 && arv_gv_device_is_controller(ARV_GV_DEVICE(device)) == 0) {
    return held(seen).value_or(Error{ErrorKind::device, "it gives nobody control", where, "cut its power"});
  }
  EMBERLOCK_ASSIGN_OR_RETURN(link->applied_, apply(camera, request, where));
  if (const auto resend = request.controls.find(kPacketResend); resend != request.controls.end()) {
    link->resend_ = resend->second;
  }
  link->pixel_format_ = arv_camera_get_pixel_format(camera, error.out());
  if (error.failed()) return error.error(ErrorKind::device, where);
  link->payload_ = arv_camera_get_payload(camera, error.out());
  if (error.failed()) return error.error(ErrorKind::device, where);
  const PackedPixels& pixels = link->applied_.offer.pixels;
  const std::size_t bytes = row_bytes(pixels) * static_cast<std::size_t>(pixels.size.height);
  if (link->payload_ < bytes) {
    return Error{ErrorKind::device, "it announces fewer bytes than its pictures have", where,
                 "choose another format"};
  }
  // A USB3 stream remembers the address of each buffer, so its buffers can't be exchanged.
  link->into_images_ =
      arv_camera_is_gv_device(camera) != 0 && lies_as_image(pixels) && link->payload_ == bytes;
  for (const std::string& note : notes_of(camera)) log(LogCategory::drivers).info("{}: {}", where, note);
  return link;
}

Link::~Link() {
  if (stream_ != nullptr && !given_up_) static_cast<void>(stop_acquisition());
}

Status Link::start() {
  ErrorSlot error;
  if (arv_camera_is_gv_device(camera_.get()) != 0) {
    // Aravis opens a packet socket before it sets its filter, and takes packets of other cameras in between
    // for this camera's frames. A socket bound to its own port doesn't have this fault and doesn't need root.
    arv_camera_gv_set_stream_options(camera_.get(), ARV_GV_STREAM_OPTION_PACKET_SOCKET_DISABLED);
  }
  stream_.reset(arv_camera_create_stream(camera_.get(), nullptr, nullptr, error.out()));
  if (stream_ == nullptr) return error.error(ErrorKind::device, where_, "it may have been taken over");
  if (ARV_IS_GV_STREAM(stream_.get())) {
    if (!resend_.empty()) {
      g_object_set(
          stream_.get(), "packet-resend",
          resend_ == "always" ? ARV_GV_STREAM_PACKET_RESEND_ALWAYS : ARV_GV_STREAM_PACKET_RESEND_NEVER,
          nullptr);
    }
    ArvGvStreamPacketResend policy = ARV_GV_STREAM_PACKET_RESEND_NEVER;
    g_object_get(stream_.get(), "packet-resend", &policy, nullptr);
    resends_ = policy == ARV_GV_STREAM_PACKET_RESEND_ALWAYS;
    // The socket's buffer must hold bursts of whole frames; the kernel limits it to net.core.rmem_max.
    constexpr std::size_t kFrames = 4;
    const auto bytes = static_cast<int>(std::min<std::size_t>(kFrames * payload_, 64U << 20U));
    g_object_set(stream_.get(), "socket-buffer", ARV_GV_STREAM_SOCKET_BUFFER_FIXED, "socket-buffer-size",
                 bytes, nullptr);
    // Aravis does this when the first packet has arrived, which is too late for the first frame.
    enlarge_socket(arv_gv_stream_get_port(ARV_GV_STREAM(stream_.get())), bytes);
  }
  EMBERLOCK_RETURN_IF_ERROR(queue_buffers());
  last_came_ = SteadyClock().now();
  arv_camera_start_acquisition(camera_.get(), error.out());
  if (!error.failed()) return {};
  stream_.reset();
  return error.error(ErrorKind::device, where_);
}

Status Link::queue_buffers() {
  constexpr std::size_t kMostMemory = 256U << 20U;
  constexpr std::size_t kManyFrames = 50;
  const auto one_second = static_cast<std::size_t>(std::ceil(applied_.frame_rate.value())) + 1;
  std::size_t n = std::max(kManyFrames, one_second);
  if (n * payload_ > kMostMemory) n = std::max<std::size_t>({one_second, kMostMemory / payload_, 4});
  for (std::size_t i = 0; i < n; ++i) push(new_buffer());
  return {};
}

Status Link::stop_acquisition() {
  ErrorSlot error;
  arv_camera_stop_acquisition(camera_.get(), error.out());
  if (error.failed()) return error.error(ErrorKind::device, where_);
  return {};
}

Result<TimePoint> Link::restart_acquisition() {
  ErrorSlot error;
  arv_camera_stop_acquisition(camera_.get(), error.out());
  const TimePoint restarted = SteadyClock().now();
  if (!error.failed()) arv_camera_start_acquisition(camera_.get(), error.out());
  if (error.failed()) return error.error(ErrorKind::device, where_);
  return restarted;
}

ObjectPtr<ArvBuffer> Link::new_buffer() const {
  if (!into_images_) return ObjectPtr<ArvBuffer>(arv_buffer_new_allocate(payload_));
  auto image = std::make_shared<Image>(applied_.offer.mode.layout);
  auto* memory = new ImageMemory{std::move(image)};
  return ObjectPtr<ArvBuffer>(
      arv_buffer_new_full(payload_, memory->image->bytes().data(), memory, free_memory));
}

void Link::push(ObjectPtr<ArvBuffer> buffer) {
  // If the packet with the id is lost, the library leaves the id of an earlier frame there.
  arv_buffer_set_frame_id(buffer.get(), kNoId);
  arv_stream_push_buffer(stream_.get(), buffer.release());
}

Arrival Link::classify(ArvBuffer* buffer) const {
  switch (arv_buffer_get_status(buffer)) {
    case ARV_BUFFER_STATUS_SUCCESS:
      break;
    case ARV_BUFFER_STATUS_TIMEOUT:
      return resends_ ? Arrival::resend : Arrival::transport;
    case ARV_BUFFER_STATUS_CLEARED:
    case ARV_BUFFER_STATUS_ABORTED:
    case ARV_BUFFER_STATUS_FILLING:
      return Arrival::cleared;
    default:  // packets missing, wrongly numbered, or too many
      return Arrival::transport;
  }
  if (arv_buffer_get_payload_type(buffer) != ARV_BUFFER_PAYLOAD_TYPE_IMAGE &&
      arv_buffer_get_payload_type(buffer) != ARV_BUFFER_PAYLOAD_TYPE_EXTENDED_CHUNK_DATA) {
    return Arrival::odd;
  }
  const ImageSize size = applied_.offer.pixels.size;
  std::size_t received = 0;
  arv_buffer_get_image_data(buffer, &received);
  const std::size_t wanted = row_bytes(applied_.offer.pixels) * static_cast<std::size_t>(size.height);
  const bool as_agreed = received >= wanted && arv_buffer_get_image_width(buffer) == size.width &&
                         arv_buffer_get_image_height(buffer) == size.height &&
                         arv_buffer_get_image_pixel_format(buffer) == pixel_format_;
  return as_agreed ? Arrival::whole : Arrival::odd;
}

std::optional<Arrived> Link::pop(Seconds deadline) {
  const auto wait = static_cast<guint64>(std::max(0.0, in_microseconds(deadline)));
  ObjectPtr<ArvBuffer> buffer(wait == 0 ? arv_stream_try_pop_buffer(stream_.get())
                                        : arv_stream_timeout_pop_buffer(stream_.get(), wait));
  if (buffer == nullptr) return {};
  Arrived arrived;
  arrived.arrival = classify(buffer.get());
  const std::uint64_t id = arv_buffer_get_frame_id(buffer.get());
  if (id != kNoId) arrived.frame_id = id;
  arrived.device_time = {static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer.get()))};
  arrived.system_time = {static_cast<std::int64_t>(arv_buffer_get_system_timestamp(buffer.get()))};
  // Aravis gives only the wall clock, which may be changed while a buffer waits here; buffers arrive in
  // order.
  const TimePoint now = SteadyClock().now();
  arrived.came = std::clamp(now - (wall_clock() - arrived.system_time), last_came_, now);
  last_came_ = arrived.came;
  arrived.buffer = std::move(buffer);
  return arrived;
}

Result<std::shared_ptr<const Image>> Link::take(Arrived arrived) {
  ArvBuffer* buffer = arrived.buffer.get();
  if (into_images_) {
    auto* memory = static_cast<const ImageMemory*>(arv_buffer_get_user_data(buffer));
    std::shared_ptr<const Image> image = memory->image;
    push(new_buffer());
    return image;
  }
  std::size_t size = 0;
  const auto* data = static_cast<const std::byte*>(arv_buffer_get_data(buffer, &size));
  const PackedPixels& pixels = applied_.offer.pixels;
  int padding = 0, unused = 0;
  arv_buffer_get_image_padding(buffer, &padding, &unused);
  auto image = unpack(pixels, {data, size}, row_bytes(pixels) + static_cast<std::size_t>(padding));
  push(std::move(arrived.buffer));
  EMBERLOCK_ASSIGN_OR_RETURN(Image unpacked, std::move(image));
  return std::shared_ptr<const Image>(std::make_shared<Image>(std::move(unpacked)));
}

std::uint64_t Link::signs_of_life() const {
  return arv_stream_get_info_uint64_by_name(stream_.get(), "n_transferred_bytes") +
         arv_stream_get_info_uint64_by_name(stream_.get(), "n_ignored_bytes");
}

bool Link::starving() const {
  gint waiting = 0;
  arv_stream_get_n_buffers(stream_.get(), &waiting, nullptr);
  return waiting <= 0 && ARV_IS_GV_STREAM(stream_.get());  // USB3 uses all buffers at once
}

}  // namespace emberlock::drivers::aravis
