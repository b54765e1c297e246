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

/// What became of a buffer that Aravis gave back.
enum class Arrival {
  whole,
  odd,        ///< declared whole, but its size or format isn't what was agreed: stripes (aravis#27, #396)
  transport,  ///< packets of it were lost
  resend,     ///< and asked for again, in vain
  cleared,    ///< it was being filled when the stream was stopped
};

/// A buffer with what it says of its frame.
struct Arrived {
  Arrival arrival = Arrival::whole;
  std::optional<std::uint64_t> frame_id;  ///< none where that part never came
  TimePoint device_time;
  TimePoint system_time;  ///< when its first packet came, by the wall clock
  TimePoint came;         ///< the same on the host's monotonic clock, not before the one popped before it
  ObjectPtr<ArvBuffer> buffer;
};

/// A camera under control, and its stream while it films. Each call may hang as long as the library does, but
/// those of a stream that runs (pop, take, recycle, signs_of_life), which only look at queues. One thread at
/// a time; it may be another one each time. The destructor gives the control back; it may hang too.
class Link {
 public:
  /// Takes control and sets it up. Errors as CameraDriver::open.
  static Result<std::shared_ptr<Link>> open(const Seen& seen, const CameraRequest& request);
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  [[nodiscard]] const Applied& applied() const { return applied_; }
  [[nodiscard]] const Seen& seen() const { return seen_; }
  /// The camera went away or another program took it over; told by the library within 6 s or so.
  [[nodiscard]] bool control_lost() const { return *control_lost_; }

  /// It is gone: closing wastes no time on telling it to stop.
  void give_up() { given_up_ = true; }

  Status start();
  /// Films no longer; what was on its way may still be popped.
  Status stop_acquisition();
  /// No longer has a stream.
  void close_stream() { stream_.reset(); }
  /// Stops and starts the sensor's cycle, the stream goes on. When it was started.
  Result<TimePoint> restart_acquisition();

  std::optional<Arrived> pop(Seconds deadline);
  /// Its pixels, with one copy at most; the buffer, or another in its place, waits for a frame again.
  Result<std::shared_ptr<const Image>> take(Arrived arrived);
  /// Without its pixels.
  void recycle(Arrived arrived) { push(std::move(arrived.buffer)); }
  /// Grows with whatever comes from the camera, used or not.
  [[nodiscard]] std::uint64_t signs_of_life() const;
  /// Whether no buffer waits for a frame. (How many underruns Aravis counts is of no use before 0.8.29.)
  [[nodiscard]] bool starving() const;

 private:
  Link() = default;
  Status queue_buffers();
  void push(ObjectPtr<ArvBuffer> buffer);
  [[nodiscard]] ObjectPtr<ArvBuffer> new_buffer() const;
  [[nodiscard]] Arrival judge(ArvBuffer* buffer) const;

  Seen seen_;
  std::string where_, resend_;
  Applied applied_;
  ArvPixelFormat pixel_format_ = 0;
  std::size_t payload_ = 0;   ///< bytes the camera sends a frame
  bool into_images_ = false;  ///< buffers are the memory of images
  bool resends_ = false;
  bool given_up_ = false;
  std::shared_ptr<std::atomic<bool>> control_lost_ = std::make_shared<std::atomic<bool>>(false);
  ObjectPtr<ArvCamera> camera_;
  TimePoint last_came_;          ///< of the buffer popped last
  ObjectPtr<ArvStream> stream_;  ///< while it films; let go before the camera
};

}  // namespace emberlock::drivers::aravis
