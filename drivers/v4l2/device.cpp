// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/device.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <string_view>
#include <thread>

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>

#include "drivers/holder.h"

namespace emberlock::drivers {
namespace {

v4l2_buffer mapped_buffer(std::uint32_t index) {
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  return buffer;
}

v4l2_requestbuffers request_for(std::uint32_t count) {
  v4l2_requestbuffers request{};
  request.count = count;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  return request;
}

int call(int fd, unsigned long request, void* argument) {
  int result = 0;
  do {
    result = ::ioctl(fd, request, argument);
  } while (result != 0 && errno == EINTR);
  return result == 0 ? 0 : errno;
}

}  // namespace

V4l2Device::Mapped::~Mapped() {
  if (!bytes_.empty()) ::munmap(bytes_.data(), bytes_.size());
}

V4l2Device::V4l2Device(UniqueFd fd, std::filesystem::path node, std::string where)
    : fd_(std::move(fd)), node_(std::move(node)), where_(std::move(where)) {}

Result<V4l2Device> V4l2Device::open(const std::filesystem::path& node, const std::string& where) {
  UniqueFd fd(::open(node.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  if (!fd) {
    const int error = errno;
    if (error == EBUSY) return held_error(node, where);
    return Error{ErrorKind::device, "can't open " + node.string() + " (" + std::strerror(error) + ")", where,
                 error == EACCES ? "join the group that owns it, see udev/README.md" : "plug it in again"};
  }
  return V4l2Device(std::move(fd), node, where);
}

int V4l2Device::ioctl(unsigned long request, void* argument) const {
  return call(fd_.get(), request, argument);
}

Ioctl V4l2Device::as_ioctl() const {
  return [fd = fd_.get()](unsigned long request, void* argument) { return call(fd, request, argument); };
}

Error V4l2Device::refused(const std::string& what, int error) const {
  if (error == EBUSY) return held_error(node_, where_);
  return {ErrorKind::device, what + " failed (" + std::strerror(error) + ")", where_, "plug it in again"};
}

std::optional<std::string> V4l2Device::camera_card() const {
  v4l2_capability about{};
  if (ioctl(VIDIOC_QUERYCAP, &about) != 0) return {};
  const auto can = (about.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? about.device_caps : about.capabilities;
  constexpr std::uint32_t kNeeded = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  if ((can & kNeeded) != kNeeded) return {};
  const auto* const card = reinterpret_cast<const char*>(about.card);
  return std::string(card, ::strnlen(card, sizeof about.card));
}

bool V4l2Device::is_uvc() const {
  v4l2_capability about{};
  if (ioctl(VIDIOC_QUERYCAP, &about) != 0) return false;
  return std::string_view(reinterpret_cast<const char*>(about.driver)) == "uvcvideo";
}

bool V4l2Device::in_use() const {
  // A request for no buffers has no effect if nobody has any.
  auto none = request_for(0);
  return ioctl(VIDIOC_REQBUFS, &none) == EBUSY;
}

Result<std::uint32_t> V4l2Device::map_buffers(std::uint32_t count) {
  auto request = request_for(count);
  if (const int error = ioctl(VIDIOC_REQBUFS, &request); error != 0)
    return refused("asking for buffers", error);
  std::uint32_t flags = 0;
  for (std::uint32_t i = 0; i < request.count; ++i) {
    v4l2_buffer buffer = mapped_buffer(i);
    if (const int error = ioctl(VIDIOC_QUERYBUF, &buffer); error != 0)
      return refused("asking for a buffer", error);
    flags = buffer.flags;
    void* const at =
        ::mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, fd_.get(), buffer.m.offset);
    if (at == MAP_FAILED) return refused("mapping a buffer", errno);
    buffers_.emplace_back(std::span(static_cast<std::byte*>(at), buffer.length));
  }
  ours_.assign(buffers_.size(), true);
  if (buffers_.empty()) return refused("asking for buffers", ENOMEM);
  return flags;
}

void V4l2Device::queue(std::uint32_t index) {
  v4l2_buffer buffer = mapped_buffer(index);
  ours_[index] = ioctl(VIDIOC_QBUF, &buffer) != 0;
}

Status V4l2Device::stream_on() {
  for (std::uint32_t i = 0; i < buffers_.size(); ++i) queue(i);
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (const int error = ioctl(VIDIOC_STREAMON, &type); error != 0) {
    stream_off();
    return refused("starting to film", error);
  }
  return {};
}

void V4l2Device::stream_off() {
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  // Fails if the device is gone, which doesn't matter.
  (void)ioctl(VIDIOC_STREAMOFF, &type);
  ours_.assign(buffers_.size(), true);
}

V4l2Device::Taken V4l2Device::take() {
  v4l2_buffer buffer = mapped_buffer(0);
  const int error = ioctl(VIDIOC_DQBUF, &buffer);
  if (error == EAGAIN) return {};
  if (error != 0) return {{}, error};
  if (buffer.index >= buffers_.size()) return {{}, EIO};
  ours_[buffer.index] = true;
  return {Filled{buffer, buffers_[buffer.index].bytes()}, 0};
}

void V4l2Device::wait(Seconds deadline) {
  for (std::uint32_t i = 0; i < ours_.size(); ++i) {
    if (ours_[i]) queue(i);
  }
  pollfd ready{fd_.get(), POLLIN, 0};
  (void)::poll(&ready, 1, static_cast<int>(std::ceil(std::max(in_milliseconds(deadline), 0.0))));
  // With no buffer queued, poll returns this error at once and repeatedly.
  if ((ready.revents & (POLLERR | POLLIN)) == POLLERR)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
}

}  // namespace emberlock::drivers
