// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "base/frame.h"
#include "base/result.h"
#include "drivers/aravis/discovery.h"
#include "drivers/aravis/library.h"
#include "drivers/aravis/settings.h"
#include "drivers/driver.h"

namespace emberlock::drivers::aravis {

/// The state of a buffer that Aravis returned.
enum class Arrival {
  whole,
  odd,        ///< marked complete, but size or format differ from the agreed ones: stripes (aravis#27, #396)
  transport,  ///< packets were lost
  resend,     ///< packets were lost, requested again, and didn't come
  cleared,    ///< it was being filled when the stream stopped
};

/// A buffer, with the data of its frame.
struct Arrived {
  Arrival arrival = Arrival::whole;
  std::optional<std::uint64_t> frame_id;  ///< absent if the packet with the id was lost
  TimePoint device_time;
  TimePoint system_time;  ///< wall clock time of its first packet
  TimePoint came;  ///< the same on the host's monotonic clock; not earlier than the buffer popped before
  ObjectPtr<ArvBuffer> buffer;
};

/// A camera under our control, and its stream while it films. Every call may hang as long as the library
/// does, except those that only look at a running stream's queues (pop, take, recycle, signs_of_life). One
/// thread at a time, not always the same. The destructor releases control and may hang too.
class Link {
 public:
  /// Takes control and applies the request. Errors as CameraDriver::open.
  static Result<std::shared_ptr<Link>> open(const DiscoveredCamera& seen, const CameraRequest& request);
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  [[nodiscard]] const Applied& applied() const { return applied_; }
  [[nodiscard]] const DiscoveredCamera& discovered() const { return discovered_; }
  /// The camera has gone or another program took control. The library reports it within about 6 s.
  [[nodiscard]] bool control_lost() const { return *control_lost_; }

  /// Tells that the camera is gone, so that closing doesn't wait for it to stop.
  void give_up() { given_up_ = true; }

  Status start();
  /// Stops filming. Frames under way may still be popped.
  Status stop_acquisition();
  /// Destroys the stream.
  void close_stream() { stream_.reset(); }
  /// Restarts the sensor's cycle while the stream continues. Returns the time of the start.
  Result<TimePoint> restart_acquisition();

  std::optional<Arrived> pop(Seconds deadline);
  /// The pixels of a buffer, with at most one copy. A buffer is queued again in return.
  Result<std::shared_ptr<const Image>> take(Arrived arrived);
  /// Queues a buffer again without reading its pixels.
  void recycle(Arrived arrived) { push(std::move(arrived.buffer)); }
  /// Grows with everything that comes from the camera, used or not.
  [[nodiscard]] std::uint64_t signs_of_life() const;
  /// Whether no buffer is free for a frame. (Aravis's count of underruns isn't usable before 0.8.29.)
  [[nodiscard]] bool starving() const;

 private:
  Link() = default;
  Status queue_buffers();
  void push(ObjectPtr<ArvBuffer> buffer);
  [[nodiscard]] ObjectPtr<ArvBuffer> new_buffer() const;
  [[nodiscard]] Arrival classify(ArvBuffer* buffer) const;

  DiscoveredCamera discovered_;
  std::string where_, resend_;
  Applied applied_;
  ArvPixelFormat pixel_format_ = 0;
  std::size_t payload_ = 0;   ///< bytes per frame
  bool into_images_ = false;  ///< the buffers are the memory of images
  bool resends_ = false;
  bool given_up_ = false;
  std::shared_ptr<std::atomic<bool>> control_lost_ = std::make_shared<std::atomic<bool>>(false);
  ObjectPtr<ArvCamera> camera_;
  TimePoint last_came_;          ///< of the last popped buffer
  ObjectPtr<ArvStream> stream_;  ///< while it films; destroyed before the camera
};

}  // namespace emberlock::drivers::aravis
